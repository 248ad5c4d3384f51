// Resolves the modules that pages import as "touchdown/<name>.js", as an import map does there.
const STATIC = new URL("../../src/touchdown/web/static/", import.meta.url);
const PREFIX = "touchdown/";

export async function resolve(specifier, context, next) {
  if (!specifier.startsWith(PREFIX)) return next(specifier, context);
  const { href } = new URL(specifier.slice(PREFIX.length), STATIC);
  return { url: href, format: "module", shortCircuit: true };
}
