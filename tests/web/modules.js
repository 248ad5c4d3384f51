// What a module of WebAssembly asks for.
import { fromBase64 } from "tests/base64.js";

/** @param {{module: string}} request Its bytes in base64. */
export function imports({ module }) {
  return WebAssembly.Module.imports(new WebAssembly.Module(fromBase64(module)));
}
