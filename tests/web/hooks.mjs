// Finds the modules that pages import as "touchdown/<name>.js", as an import map does there.
const STATIC = new URL("../../src/touchdown/web/static/", import.meta.url);
const PREFIX = "touchdown/";

export async function resolve(specifier, context, next) {
  const ours = specifier.startsWith(PREFIX);
  const url = ours ? new URL(specifier.slice(PREFIX.length), STATIC).href : specifier;
  const found = await next(url, context);
  return found.url.endsWith(".js") ? { ...found, format: "module" } : found;
}
