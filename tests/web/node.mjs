// Answers a request on the standard input: node --no-warnings node.mjs MODULE FUNCTION < request
import { readFileSync } from "node:fs";
import { register } from "node:module";

register("./hooks.mjs", import.meta.url);
const [name, called] = process.argv.slice(2);
const module = await import(name);
process.stdout.write(JSON.stringify(await module[called](JSON.parse(readFileSync(0, "utf8")))));
