// What a browser needs to have, so that the clarinet sounds.

/** Why this browser cannot play the page, if it cannot. */
export function whySilent() {
  if (!globalThis.AudioContext || !globalThis.WebAssembly) return 'this browser is too old: use one from 2023 or later';
  if (!globalThis.isSecureContext) return `a browser plays this page from https or from localhost only, and not from ${location.origin}`;
  if (!globalThis.AudioWorkletNode) return 'this browser has no AudioWorklet: use one from 2023 or later';
  return undefined;
}

/** A WebAssembly module. */
export async function compiled(address) {
  let answer;
  try {
    answer = await fetch(address);
  } catch {
    throw new Error(`${address} could not be loaded: is there a network?`);
  }
  if (!answer.ok) throw new Error(`${address} could not be loaded (${answer.status})`);
  // A host that calls the file something else than application/wasm must not matter.
  return WebAssembly.compile(await answer.arrayBuffer());
}

/** The gain of a volume, 0..1: the ear hears the square. */
export function gainOfShare(share) {
  return share * share * 1.25;
}
