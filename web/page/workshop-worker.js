// A worker with the module that moves holes, prepares instruments, and computes what a knob should feel like.

const load = async () => {
  // `cargo xtask web` fills in the name that it has in this version of the page.
  const answer = await fetch('workshop.wasm');
  if (!answer.ok) throw new Error(`the server answers ${answer.status}`);
  return (await WebAssembly.instantiate(await answer.arrayBuffer(), {})).instance.exports;
};
const loading = load();
// Told with the first question.
loading.catch(() => {});

onmessage = async ({ data: { number, question } }) => {
  let module;
  try {
    module = await loading;
  } catch (error) {
    return postMessage({ number, failed: String(error.message ?? error), isLost: true });
  }
  try {
    const bytes = new TextEncoder().encode(JSON.stringify(question));
    const place = module.chalumeau_inbox(bytes.length);
    if (place === 0) throw new Error('it is larger than a megabyte');
    new Uint8Array(module.memory.buffer, place, bytes.length).set(bytes);
    const length = module.chalumeau_workshop();
    const answer = Uint8Array.from(new Uint8Array(module.memory.buffer, module.chalumeau_outbox(), length));
    // Everything but a feel is JSON, and a feel does not begin with a brace.
    if (answer[0] !== 0x7b) return postMessage({ number, answer });
    const told = JSON.parse(new TextDecoder().decode(answer));
    postMessage(told.failed ? { number, failed: told.failed } : { number, answer: told });
  } catch (error) {
    postMessage({ number, failed: String(error.message ?? error) });
  }
};
