// Worker of the page, behind module.js: it runs scenarios, so that the page stays responsive.

// Messages to the page at most, in a second.
const UPDATES_PER_S = 20;
let wasm = null;

self.onmessage = async ({ data }) => {
  if (data.bytes) {
    wasm = WebAssembly.compile(data.bytes);
    return;
  }
  const begun = performance.now();
  let shown = begun;
  const progress = (share) => {
    const now = performance.now();
    if (now < shown + 1000 / UPDATES_PER_S) return;
    shown = now;
    self.postMessage({ number: data.number, share });
  };
  const failed = (error) => ({ error: `The rig does not load: ${error.message}` });
  const answer = await wasm.then((module) => answerOf(module, data.request, progress)).catch(failed);
  self.postMessage({ number: data.number, answer, wall_s: (performance.now() - begun) / 1000 });
};
