// The listening page: each sound is made by the module when it is first asked for, much faster than it sounds, and drawn.

import { Kept } from './kept.js';
import { clamp, json } from './names.js';
import { compiled, gainOfShare, whySilent } from './sound.js';

/** Time in which a sound that is stopped fades, s. */
const FADE_S = 0.02;
/** Columns of a picture. */
const COLUMNS = 360;
/** Range of its height, dB below full scale. */
const RANGE_DB = 48;
const get = (id) => document.getElementById(id);
const tour = await json('tour.json').catch((error) => {
  get('trouble').textContent = `No sound: ${error.message}`;
  throw error;
});
const silent = whySilent();
if (silent) get('trouble').textContent = `No sound: ${silent}.`;
let module;
let context;
let loudness;
let playing;
/** Which of the clicks is the latest. */
let clicks = 0;

for (const { title, stops } of tour.chapters) {
  const chapter = document.createElement('section');
  const heading = document.createElement('h2');
  heading.textContent = title;
  chapter.append(heading, ...stops.map(card));
  get('chapters').append(chapter);
}

function card(stop) {
  const button = document.createElement('button');
  button.className = 'stop-card';
  button.setAttribute('aria-pressed', 'false');
  const [sign, words, picture, name, what] = ['i', 'span', 'canvas', 'b', 'small'].map((kind) => document.createElement(kind));
  sign.setAttribute('aria-hidden', 'true');
  name.textContent = stop.title;
  what.textContent = `${stop.words} ${(stop.samples / tour.rate).toFixed(0)} s.`;
  words.append(name, what);
  picture.setAttribute('aria-hidden', 'true');
  button.append(sign, words, picture);
  button.onclick = () => toggle(stop, button, picture).catch((error) => {
    button.classList.remove('making');
    get('trouble').textContent = `No sound: ${error.message}`;
  });
  return button;
}

async function toggle(stop, button, picture) {
  if (silent) return;
  // In the gesture: a browser lets a page sound only then.
  context ??= new AudioContext({ sampleRate: tour.rate });
  // On a telephone, it sounds even where its ringing is muted.
  if (navigator.audioSession) navigator.audioSession.type = 'playback';
  context.resume();
  const same = playing?.stop === stop || button.classList.contains('making');
  const click = (clicks += 1);
  end();
  document.querySelectorAll('.making').forEach((other) => other.classList.remove('making'));
  if (same) return;
  button.classList.add('making');
  stop.making ??= made(stop);
  try {
    stop.sound = await stop.making;
    get('trouble').textContent = '';
  } catch (error) {
    stop.making = undefined;
    throw error;
  }
  // Another one has been asked for meanwhile, or this one again to stop it.
  if (click !== clicks) return;
  button.classList.remove('making');
  const source = new AudioBufferSourceNode(context, { buffer: stop.sound });
  const gain = new GainNode(context, { gain: 1 });
  source.connect(gain).connect(volume());
  const own = (playing = { stop, button, source, gain, began: context.currentTime });
  source.onended = () => playing === own && end();
  source.start();
  button.setAttribute('aria-pressed', 'true');
  follow(own, picture);
}

/** The volume of the page that plays; here it can be set, too. */
function volume() {
  if (!loudness) {
    loudness = new GainNode(context, { gain: gainOf(get('volume').value) });
    loudness.connect(context.destination);
  }
  return loudness;
}

/** As the page that plays has it: the ear hears the square. */
function gainOf(percent) {
  return gainOfShare(percent / 100);
}

get('volume').value = Kept.volume() ?? get('volume').value;
get('volume').oninput = ({ target }) => {
  loudness?.gain.setTargetAtTime(gainOf(target.value), context.currentTime, 0.015);
  Kept.keepVolume(Number(target.value));
};
addEventListener('keydown', ({ key }) => {
  if (key !== 'Escape') return;
  clicks += 1;
  document.querySelectorAll('.making').forEach((card) => card.classList.remove('making'));
  end();
});

function end() {
  if (!playing) return;
  const { source, button, gain } = playing;
  playing = null;
  // Not in the middle of a wave.
  gain.gain.setTargetAtTime(0, context.currentTime, FADE_S / 4);
  source.stop(context.currentTime + FADE_S);
  button.setAttribute('aria-pressed', 'false');
}

/** The sound, by the module in an audio worklet that need not wait for time to pass. */
async function made({ samples, messages }) {
  module ??= await compiled('chalumeau.wasm');
  const offline = new OfflineAudioContext(2, samples, tour.rate);
  await offline.audioWorklet.addModule('worklet.js');
  const processorOptions = { module, instrument: 0, score: { score: messages } };
  const node = new AudioWorkletNode(offline, 'chalumeau', { outputChannelCount: [2], processorOptions });
  node.connect(offline.destination);
  const failed = new Promise((_, reject) => {
    node.port.onmessage = ({ data }) => data.failed && reject(new Error(data.failed));
    node.onprocessorerror = () => reject(new Error('the sound could not be computed'));
  });
  return Promise.race([offline.startRendering(), failed]);
}

/** Draws the sound, and how much of it has been heard. */
function follow(own, canvas) {
  const ratio = devicePixelRatio || 1;
  // On a telephone, one without a width is hidden (`style.css`) and could not be measured.
  canvas.width = 1;
  [canvas.width, canvas.height] = [ratio * canvas.clientWidth, ratio * canvas.clientHeight];
  const g = canvas.getContext('2d');
  const samples = own.stop.sound.getChannelData(0);
  const step = Math.ceil(samples.length / COLUMNS);
  own.stop.peaks ??= Array.from({ length: COLUMNS }, (_, n) => samples.subarray(n * step, (n + 1) * step).reduce((most, x) => Math.max(most, Math.abs(x)), 0));
  const style = getComputedStyle(document.documentElement);
  const [heard, ahead] = ['--breath', '--quiet'].map((name) => style.getPropertyValue(name));
  const draw = () => {
    const share = playing === own ? (context.currentTime - own.began) / own.stop.sound.duration : 0;
    g.clearRect(0, 0, canvas.width, canvas.height);
    own.stop.peaks.forEach((peak, n) => {
      // In dB, so that the softest scale is seen, too.
      const height = Math.max(1, clamp(1 + 20 * Math.log10(peak + 1e-9) / RANGE_DB, 0, 1) * canvas.height);
      g.fillStyle = n / COLUMNS < share ? heard : ahead;
      g.fillRect((n * canvas.width) / COLUMNS, (canvas.height - height) / 2, Math.max(1, canvas.width / COLUMNS - 0.5), height);
    });
    if (playing === own) requestAnimationFrame(draw);
  };
  draw();
}

/** For tests. */
globalThis.listen = { tour, made, playing: () => playing?.stop.title };
