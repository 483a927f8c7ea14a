// What a microphone hears in the tests: a room, somebody who blows at it, and speech.

import { execFileSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

export const RATE = 48000;
/** Quiet at the beginning, while the page measures the room, s. */
export const QUIET_S = 4;
/** Level of the room, of full scale. */
const ROOM = 6e-4;

/** Uniform noise, -1..1, the same on every machine: a linear congruential generator (Numerical Recipes). */
export function noise(seed) {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 31 - 1;
  };
}

export function room(seconds, seed = 1) {
  const next = noise(seed);
  return Float32Array.from({ length: Math.round(seconds * RATE) }, () => ROOM * next());
}

/**
 * Wind at a microphone: noise whose spectrum falls by 6 dB an octave above `corner` Hz, with a weak even part, that swells,
 * stays and ends.
 */
export function blow(seconds, { corner = 150, level = 0.25, seed = 7 } = {}) {
  const [next, share] = [noise(seed), 1 - Math.exp((-2 * Math.PI * corner) / RATE)];
  let low = 0;
  const count = Math.round(seconds * RATE);
  // Brings the filtered noise back to the level of noise.
  const gain = Math.sqrt((2 - share) / share);
  return Float32Array.from({ length: count }, (_, n) => {
    const white = next();
    low += share * (white - low);
    const swell = Math.min(1, n / (0.08 * RATE), (count - n) / (0.1 * RATE));
    return level * swell * (gain * low + 0.08 * white);
  });
}

/** Speech by espeak-ng, as loud as a voice close to the microphone. */
export function speech(text, voice, folder) {
  const path = join(folder, 'speech.wav');
  execFileSync('espeak-ng', ['-v', voice, '-w', path, text]);
  const { rate, samples } = readWav(path);
  const most = samples.reduce((most, x) => Math.max(most, Math.abs(x)), 0);
  const count = Math.floor((samples.length * RATE) / rate);
  return Float32Array.from({ length: count }, (_, n) => {
    const at = (n * rate) / RATE;
    const [before, share] = [Math.floor(at), at % 1];
    const x = samples[before] + share * ((samples[before + 1] ?? 0) - samples[before]);
    return (0.7 * x) / most;
  });
}

/** One after another, over the room's noise. */
export function sequence(...parts) {
  const samples = new Float32Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    samples.set(part, at);
    at += part.length;
  }
  const next = noise(99);
  return samples.map((x) => x + ROOM * next());
}

export function readWav(path) {
  const bytes = readFileSync(path);
  const data = bytes.indexOf('data') + 8;
  const count = Math.floor((bytes.length - data) / 2);
  const samples = Float32Array.from({ length: count }, (_, n) => bytes.readInt16LE(data + 2 * n) / 32768);
  return { rate: bytes.readUInt32LE(24), samples };
}

/** A file of 16 bits, mono. */
export function writeWav(path, samples) {
  const bytes = Buffer.alloc(44 + 2 * samples.length);
  bytes.write('RIFF', 0);
  bytes.writeUInt32LE(36 + 2 * samples.length, 4);
  bytes.write('WAVEfmt ', 8);
  bytes.writeUInt32LE(16, 16);
  bytes.writeUInt16LE(1, 20);
  bytes.writeUInt16LE(1, 22);
  bytes.writeUInt32LE(RATE, 24);
  bytes.writeUInt32LE(2 * RATE, 28);
  bytes.writeUInt16LE(2, 32);
  bytes.writeUInt16LE(16, 34);
  bytes.write('data', 36);
  bytes.writeUInt32LE(2 * samples.length, 40);
  samples.forEach((x, n) => bytes.writeInt16LE(Math.max(-32768, Math.min(32767, Math.round(32767 * x))), 44 + 2 * n));
  writeFileSync(path, bytes);
}

export const SENTENCES = [
  'Peter Piper picked a peck of pickled peppers. She sells sea shells, for this is his best ship.',
  'How loudly may we sing before all our neighbours run away? Nobody knows, but many moan.',
];
