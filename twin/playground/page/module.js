// Runs the module of the rig: each request, a JSON text, in an instance of its own. For the worker
// of the page, and for the check in Node.

// Returns the functions that the module imports: its progress, and those of a crate that are for
// JavaScript objects, which no run calls.
function importsOf(module, progress) {
  const imports = {};
  for (const { module: from, name } of WebAssembly.Module.imports(module)) {
    imports[from] ??= {};
    imports[from][name] = () => {
      throw new Error(`${from}.${name} is not available`);
    };
  }
  imports.host.progress = progress;
  return imports;
}

// Runs a request in a new instance, so that no run knows of another; returns the answer. A trap,
// and a browser that has no room for the instance, are answers, too: none leaves the page waiting.
async function answerOf(module, request, progress) {
  try {
    const { exports } = await WebAssembly.instantiate(module, importsOf(module, progress));
    const bytes = new TextEncoder().encode(JSON.stringify(request));
    const at = exports.reserve(bytes.length);
    new Uint8Array(exports.memory.buffer, at, bytes.length).set(bytes);
    const length = exports.run();
    const text = new Uint8Array(exports.memory.buffer, exports.answer(), length);
    return JSON.parse(new TextDecoder().decode(text));
  } catch (error) {
    return { report: null, page: null, error: `The rig has failed: ${error.message}` };
  }
}
