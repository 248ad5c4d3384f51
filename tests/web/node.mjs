// Answers a request on the standard input: node --no-warnings node.mjs MODULE FUNCTION < request
import { readFileSync } from "node:fs";
import { register } from "node:module";
import { pathToFileURL } from "node:url";

register("./hooks.mjs", import.meta.url);
const [path, name] = process.argv.slice(2);
const module = await import(pathToFileURL(path));
process.stdout.write(JSON.stringify(await module[name](JSON.parse(readFileSync(0, "utf8")))));
