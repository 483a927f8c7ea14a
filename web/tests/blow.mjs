// Wind at the microphone blows, speech and the room do not: node blow.mjs PAGE FOLDER.

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { RATE, SENTENCES, blow, noise, room, sequence, speech } from './sounds.mjs';

const [page, folder] = process.argv.slice(2);
const { BlowMeter } = await import(pathToFileURL(join(page, 'blow.js')));

/** Breath after every block of a worklet, the room measured before. */
function heard(samples) {
  const meter = new BlowMeter(RATE);
  meter.calibrate(2);
  const all = sequence(room(2.1), samples);
  const breath = [];
  for (let at = 0; at + 128 <= all.length; at += 128) breath.push(meter.process(all.subarray(at, at + 128)));
  assert.equal(meter.isCalibrating, false);
  return breath.slice(Math.round((2.1 * RATE) / 128));
}

const seconds = (blocks) => (128 * blocks) / RATE;

// Wind near and far, from a mouth that is wide or narrow.
for (const corner of [60, 150, 400]) {
  for (const level of [0.04, 0.25]) {
    const breath = heard(blow(1.5, { corner, level }));
    const begins = seconds(breath.findIndex((x) => x > 0.02));
    const blown = breath.filter((x) => x > 0.02).length / breath.length;
    assert.ok(begins > 0 && begins < 0.25, `${corner} Hz, ${level}: begins after ${begins} s`);
    assert.ok(blown > 0.8, `${corner} Hz, ${level}: blows for ${blown} of the time`);
  }
}
const swell = heard(sequence(blow(1, { level: 0.03 }), blow(1, { level: 0.3 })));
const mean = (from, to) => swell.slice(from, to).reduce((sum, x) => sum + x, 0) / (to - from);
const part = Math.round(RATE / 128);
assert.ok(mean(0.5 * part | 0, 0.8 * part | 0) + 0.25 < mean(1.5 * part | 0, 1.8 * part | 0), 'harder is more');
assert.equal(heard(sequence(blow(0.5), room(0.5))).at(-1), 0, 'it ends');

// Own sound that comes back from a loudspeaker does not end a blow, and does not begin one.
const odd = (hz, level) => (_, n) => [1, 3, 5, 7, 9].reduce((sum, k) => sum + (level / k) * Math.sin((2 * Math.PI * k * hz * n) / RATE), 0);
for (const hz of [147, 233, 466]) {
  const own = Float32Array.from({ length: 1.5 * RATE }, odd(hz, 0.1));
  // It comes after the blow has begun.
  const both = blow(1.5, { level: 0.25 }).map((x, n) => x + (n > 0.2 * RATE ? own[n] : 0));
  const blown = heard(both).filter((x) => x > 0.02).length / (both.length / 128);
  assert.ok(blown > 0.8, `${hz} Hz: blows for ${blown} of the time`);
  assert.equal(Math.max(...heard(own)), 0, `${hz} Hz alone`);
}
// The clarinet does not blow itself where it comes back as loud as the wind.
const soft = blow(1.5, { level: 0.1 });
const loud = Float32Array.from({ length: soft.length }, odd(233, 0.08));
const [alone, beside] = [soft, soft.map((x, n) => x + (n > 0.2 * RATE ? loud[n] : 0))].map((samples) => {
  const later = heard(samples).slice(Math.round((0.5 * RATE) / 128), Math.round((1.3 * RATE) / 128));
  return later.reduce((sum, x) => sum + x, 0) / later.length;
});
assert.ok(beside < alone + 0.2 && beside > 0.05, `${alone} alone, ${beside} beside its own sound`);
console.log(`a soft blow gives ${alone.toFixed(2)}, and ${beside.toFixed(2)} beside a clarinet that is as loud`);
// Who speaks at the end of a blow does not go on blowing.
for (const voice of ['en-us', 'en-gb+f3', 'en-us+m3']) {
  const after = heard(sequence(blow(0.8), speech(SENTENCES[1], voice, folder)));
  const late = Math.max(...after.slice(Math.round((1.3 * RATE) / 128)));
  assert.equal(late, 0, `${voice} goes on: ${late}`);
}

// Speech: several voices, loud.
let spoken = 0;
for (const voice of ['en-us', 'en-gb+f3', 'en-us+m3', 'en+croak', 'de+f2', 'fr+m1']) {
  for (const text of SENTENCES) {
    const breath = heard(speech(text, voice, folder));
    spoken += seconds(breath.length);
    const most = Math.max(...breath);
    assert.equal(most, 0, `${voice} plays, ${most}: ${text}`);
  }
}
// A sung tone, a whistle, a room that becomes louder by 6 dB, clicks of keys.
const tone = (hz, partials) =>
  Float32Array.from({ length: RATE }, (_, n) => {
    let x = 0;
    for (let k = 1; k <= partials; k += 1) x += Math.sin((2 * Math.PI * k * hz * n) / RATE) / k;
    return 0.2 * x;
  });
const clicks = Float32Array.from({ length: 2 * RATE }, (_, n) => (n % (RATE / 8) < 200 ? 0.3 * noise(n)() : 0));
const others = { voice: tone(130, 20), whistle: tone(1200, 1), room: room(2, 5).map((x) => 2 * x), clicks };
for (const [name, samples] of Object.entries(others)) assert.equal(Math.max(...heard(samples)), 0, `${name} plays`);
console.log(`wind blows, also beside the clarinet's own sound; ${spoken.toFixed(0)} s of speech in 6 voices, singing, a whistle, clicks and the room do not`);
