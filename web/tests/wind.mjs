// Real speech at the microphone does not play, wind does: node wind.mjs PAGE FOLDER. The module hears it as in the worklet. All other
// sounds are tested beside the algorithm, in crates/core/src/control/wind/tests.rs.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { RATE, SENTENCES, blow, room, sequence, speech } from './sounds.mjs';

const [page, folder] = process.argv.slice(2);
const module = new WebAssembly.Module(readFileSync(join(page, 'chalumeau.wasm')));
const BLOCK = 128;
/** The room is measured for two seconds. */
const QUIET_S = 2.1;

/** Breath after every block of a worklet, the room measured before. */
function heard(samples) {
  const { exports: clarinet } = new WebAssembly.Instance(module, {});
  assert.equal(clarinet.chalumeau_begin(RATE, 0), 1);
  clarinet.chalumeau_microphone(1);
  clarinet.chalumeau_calibrate();
  const input = new Float32Array(clarinet.memory.buffer, clarinet.chalumeau_input(), BLOCK);
  const wind = new Float32Array(clarinet.memory.buffer, clarinet.chalumeau_wind(), 4);
  const all = sequence(room(QUIET_S), samples);
  const breath = [];
  for (let at = 0; at + BLOCK <= all.length; at += BLOCK) {
    input.set(all.subarray(at, at + BLOCK));
    clarinet.chalumeau_hear(BLOCK);
    clarinet.chalumeau_wind();
    breath.push(wind[2]);
  }
  assert.equal(wind[3], 0, 'it still measures the room');
  assert.equal(wind.buffer, clarinet.memory.buffer, 'it has allocated');
  return breath.slice(Math.round((QUIET_S * RATE) / BLOCK));
}

const seconds = (blocks) => (BLOCK * blocks) / RATE;

const wind = heard(blow(1.5));
const blown = wind.filter((x) => x > 0.02).length / wind.length;
assert.ok(blown > 0.8, `blows for ${blown} of the time`);
let spoken = 0;
for (const voice of ['en-us', 'en-gb+f3', 'en-us+m3', 'en+croak', 'de+f2', 'fr+m1']) {
  for (const text of SENTENCES) {
    const breath = heard(speech(text, voice, folder));
    spoken += seconds(breath.length);
    const most = Math.max(...breath);
    assert.equal(most, 0, `${voice} plays, ${most}: ${text}`);
  }
}
// Who speaks at the end of a blow does not go on blowing.
for (const voice of ['en-us', 'en-gb+f3', 'en-us+m3']) {
  const after = heard(sequence(blow(0.8), speech(SENTENCES[1], voice, folder)));
  const late = Math.max(...after.slice(Math.round((1.3 * RATE) / BLOCK)));
  assert.equal(late, 0, `${voice} goes on: ${late}`);
}
console.log(`wind blows, ${spoken.toFixed(0)} s of speech in 6 voices do not`);
