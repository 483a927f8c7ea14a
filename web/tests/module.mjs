// The WebAssembly modules have the bits of the Rust code, in what they play and in the instruments that they prepare:
// node module.mjs FOLDER, as `cargo xtask web` makes it.

import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';

/** Left and right alternately, as web/tests/scores.rs hashes them. */
export function hashOf(left, right) {
  const both = new Float32Array(2 * left.length);
  left.forEach((sample, n) => both.set([sample, right[n]], 2 * n));
  return createHash('sha256').update(Buffer.from(both.buffer)).digest('hex');
}

export const scores = () => JSON.parse(readFileSync(new URL('scores.json', import.meta.url)));

/** Time of the processor, ms: what else the machine does is not in it. */
function worked() {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1000;
}

/** `times` gets the milliseconds of each block. */
function play(module, score, times) {
  const { exports: clarinet } = new WebAssembly.Instance(module, {});
  assert.equal(clarinet.chalumeau_begin(score.rate, score.instrument), 1);
  const out = [new Float32Array(score.samples), new Float32Array(score.samples)];
  let [done, next] = [0, 0];
  while (done < score.samples) {
    while (next < score.messages.length && score.messages[next][0] <= done) {
      const [, what, ...rest] = score.messages[next];
      next += 1;
      if (what === 'breath') clarinet.chalumeau_breath(...rest);
      else if (what === 'set') {
        clarinet.chalumeau_set(...rest);
        clarinet.chalumeau_settle();
      } else clarinet.chalumeau_midi(what, ...rest);
    }
    const until = score.messages[next]?.[0] ?? Infinity;
    const began = worked();
    const frames = clarinet.chalumeau_process(Math.min(128, score.samples - done, until - done));
    times.push(worked() - began);
    out.forEach((channel, at) => {
      channel.set(new Float32Array(clarinet.memory.buffer, clarinet.chalumeau_channel(at), frames), done);
    });
    done += frames;
  }
  return hashOf(...out);
}

/** The module has a name that changes with its contents. */
export const workshopOf = (folder) => readdirSync(folder).find((name) => /^workshop-[0-9a-f]{16}\.wasm$/.test(name));

const given = (path) => readFileSync(new URL(path, import.meta.url), 'utf8');

/** Hash of the instrument that the workshop prepares, as web/tests/own_instrument.rs hashes it. */
function prepared(module, question) {
  const { exports: workshop } = new WebAssembly.Instance(module, {});
  if (question.open) question = { ...question, text: given(`../../examples/instruments/${question.open}`) };
  const bytes = new TextEncoder().encode(JSON.stringify(question));
  const place = workshop.chalumeau_inbox(bytes.length);
  new Uint8Array(workshop.memory.buffer, place, bytes.length).set(bytes);
  const length = workshop.chalumeau_workshop();
  const told = Buffer.from(workshop.memory.buffer, workshop.chalumeau_outbox(), length).toString();
  const { failed, prepared } = JSON.parse(told);
  assert.equal(failed, undefined);
  return createHash('sha256').update(prepared).digest('hex');
}

if (process.argv[1] === new URL(import.meta.url).pathname) {
  const module = new WebAssembly.Module(readFileSync(join(process.argv[2], 'chalumeau.wasm')));
  assert.deepEqual(WebAssembly.Module.imports(module), [], 'the module asks for nothing');
  const times = [];
  let seconds = 0;
  for (const score of scores()) {
    assert.equal(play(module, score, times), score.hash, `${score.name}: other samples than the Rust code plays`);
    seconds += score.samples / score.rate;
  }
  times.sort((a, b) => a - b);
  const at = (share) => times[Math.floor(share * (times.length - 1))].toFixed(2);
  const faster = ((1000 * seconds) / times.reduce((sum, time) => sum + time, 0)).toFixed(0);
  console.log(`${scores().length} scores have the hashes of the Rust code, made ${faster} times as fast as they sound`);
  console.log(`a block of 128 samples takes the processor ${at(0.5)} ms; p99 ${at(0.99)}, worst ${at(1)}, of 2.67 at 48 kHz`);
  const workshop = new WebAssembly.Module(readFileSync(join(process.argv[2], workshopOf(process.argv[2]))));
  const cases = JSON.parse(given('own_instrument.json'));
  for (const { question, hash } of cases) {
    assert.equal(prepared(workshop, question), hash, `${JSON.stringify(question)}: another instrument than the Rust code's`);
  }
  console.log(`${cases.length} instruments are prepared with the numbers of the Rust code`);
}
