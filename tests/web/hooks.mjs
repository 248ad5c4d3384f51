// Finds the modules that pages import as "touchdown/<name>.js", as an import map does there, and
// those of the tests.
const FOLDERS = {
  "touchdown/": new URL("../../src/touchdown/web/static/", import.meta.url),
  "tests/": new URL("./", import.meta.url),
};

export async function resolve(specifier, context, next) {
  const ours = Object.entries(FOLDERS).find(([prefix]) => specifier.startsWith(prefix));
  if (!ours) return next(specifier, context);
  const { href } = new URL(specifier.slice(ours[0].length), ours[1]);
  return { url: href, format: "module", shortCircuit: true };
}
