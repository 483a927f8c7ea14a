// Breath from a microphone: how hard somebody blows at it, while speech and the room stay silent.
//
// Air that hits a microphone makes noise: strong at low frequencies, and without a period. A voice has a period. A hissed
// consonant has hardly anything below 500 Hz. A plosive is wind, but short. So the gate opens after wind alone for ONSET_S, and
// closes where a period is found or the wind ends. The clarinet's own sound, which comes back from a loudspeaker, has a period too,
// but nothing below 90 Hz, where wind is strong and speech weak: that keeps an open gate open, and bounds the breath. Otherwise a
// loud clarinet would blow itself. The period is found by the normalised square difference of McLeod & Wyvill
// (2005), on a signal whose spectrum is flattened first: the slope of wind noise would look like a period.
//
// The page asks for two seconds of quiet, which set the floor. The loudest blow so far is fortissimo.
//
// Plain arithmetic without an audio context: web/tests/blow.mjs feeds it with noise and with speech.

/** Time of wind alone before the gate opens, s: longer than the puff of a plosive. */
const ONSET_S = 0.07;
/** Time without a gap in which no voice may have been heard before the gate opens, s. */
const UNVOICED_S = 0.25;
/** Time without wind after which the gate closes, s. */
const CLOSE_S = 0.06;
/** Time between two decisions, s. */
const STEP_S = 0.005;
/** Rate at which a period is looked for, Hz, and the window: two periods of a low voice. */
const SLOW_HZ = 8000;
const WINDOW = 256;
/** Periods of voices, samples at SLOW_HZ: 80 to 400 Hz. */
const PERIODS = [20, 100];
/** From here on a period counts. Wind stays below 0.41; the middle of the speech in web/tests/blow.mjs has 0.4 to 0.7. */
const VOICED = 0.45;
/** Least share of a wind's power below 500 Hz, of all above 40 Hz. Wind has 0.2 and more, a hissed s 0.02. */
const WIND_SHARE = 0.2;
/** From this share below 90 Hz on it is wind, whatever has a period. Speech stays below 0.045, most wind is above. */
const DEEP_SHARE = 0.035;
/** Time over which powers are taken together, s, and the power below 90 Hz, of which there is less. */
const [MEAN_S, DEEP_S] = [0.015, 0.06];
/** The breath may be so much louder than the wind below 90 Hz makes likely, dB: its power wanders. */
const SLACK_DB = 5;
/** Level of the softest blow over the room, dB. */
const OVER_ROOM_DB = 12;
/** The room is not believed to be quieter than this, dBFS: the breath of an h is softer than wind. */
const LEAST_FLOOR_DB = -50;
/** What plays fortissimo until somebody has blown harder, dBFS. */
const LOUD_DB = -16;
/** Time constants of the breath upwards and downwards, s. */
const UP_S = 0.012;
const DOWN_S = 0.04;

/** A filter of second order: low or high pass of Butterworth (R. Bristow-Johnson's cookbook). */
class Filter {
  constructor(isHigh, corner, rate) {
    const w = 2 * Math.PI * Math.min(0.45, corner / rate);
    const [cos, alpha] = [Math.cos(w), Math.sin(w) / Math.SQRT2];
    const a0 = 1 + alpha;
    const edge = isHigh ? (1 + cos) / 2 : (1 - cos) / 2;
    this.b = [edge / a0, (isHigh ? -2 * edge : 2 * edge) / a0, edge / a0];
    this.a = [(-2 * cos) / a0, (1 - alpha) / a0];
    this.s = [0, 0];
  }

  next(x) {
    const y = this.b[0] * x + this.s[0];
    this.s[0] = this.b[1] * x - this.a[0] * y + this.s[1];
    this.s[1] = this.b[2] * x - this.a[1] * y;
    return y;
  }
}

const db = (power) => 10 * Math.log10(power + 1e-12);

export class BlowMeter {
  constructor(rate) {
    this.rate = rate;
    this.rumble = new Filter(true, 40, rate);
    this.low = new Filter(false, 500, rate);
    this.deep = [new Filter(false, 90, rate), new Filter(false, 90, rate)];
    this.slow = [new Filter(false, 3000, rate), new Filter(false, 3000, rate)];
    this.step = Math.round(STEP_S * rate);
    this.window = new Float32Array(WINDOW);
    this.at = 0;
    this.phase = 0;
    this.before = 0;
    this.count = 0;
    this.power = [0, 0, 0];
    this.mean = [0, 0, 0];
    this.deepMean = 0;
    this.overDeepDb = 0;
    this.floor = LEAST_FLOOR_DB;
    this.loud = LOUD_DB;
    this.breath = 0;
    this.wind = 0;
    this.unvoiced = 0;
    this.calm = 0;
    this.isOpen = false;
    this.quiet = null;
  }

  /** Measures the room for so many seconds; nothing plays meanwhile. */
  calibrate(seconds) {
    this.quiet = { left: Math.round(seconds / STEP_S), levels: [] };
    [this.isOpen, this.breath, this.loud] = [false, 0, LOUD_DB];
  }

  get isCalibrating() {
    return this.quiet !== null;
  }

  /** Takes samples, and gives back the breath now, 0..=1. */
  process(samples) {
    for (let n = 0; n < samples.length; n += 1) {
      const x = this.rumble.next(samples[n]);
      const low = this.low.next(x);
      this.power[0] += x * x;
      this.power[1] += low * low;
      const deep = this.deep[1].next(this.deep[0].next(x));
      this.power[2] += deep * deep;
      const slow = this.slow[1].next(this.slow[0].next(x));
      this.phase += SLOW_HZ;
      if (this.phase >= this.rate) {
        this.phase -= this.rate;
        // Flatter: the difference lifts high frequencies by 6 dB an octave.
        this.window[this.at] = slow - 0.95 * this.before;
        this.before = slow;
        this.at = (this.at + 1) % WINDOW;
      }
      this.count += 1;
      if (this.count === this.step) this.decide();
    }
    return this.breath;
  }

  /** How periodic the last 32 ms are, up to 1. */
  periodicity() {
    const at = (n) => this.window[(this.at + n) % WINDOW];
    let best = 0;
    for (let lag = PERIODS[0]; lag <= PERIODS[1]; lag += 1) {
      let [product, squares] = [0, 1e-12];
      for (let n = 0; n + lag < WINDOW; n += 1) {
        const [a, b] = [at(n), at(n + lag)];
        product += a * b;
        squares += a * a + b * b;
      }
      best = Math.max(best, (2 * product) / squares);
    }
    return best;
  }

  decide() {
    const share = 1 - Math.exp(-STEP_S / MEAN_S);
    this.mean = this.mean.map((mean, n) => mean + share * (this.power[n] / this.step - mean));
    const [all, low, deep] = this.mean;
    [this.power, this.count] = [[0, 0, 0], 0];
    const level = db(all);
    this.level = level;
    this.deepMean += (1 - Math.exp(-STEP_S / DEEP_S)) * (deep - this.deepMean);
    // How much of this wind lies below 90 Hz is learned before the clarinet sounds.
    if (!this.isOpen) this.overDeepDb = level - db(this.deepMean);
    const blown = this.isOpen ? Math.min(level, db(this.deepMean) + this.overDeepDb + SLACK_DB) : level;
    if (this.quiet) {
      this.quiet.levels.push(level);
      this.quiet.left -= 1;
      if (this.quiet.left <= 0) {
        // What the room exceeds a tenth of the time.
        const levels = this.quiet.levels.sort((a, b) => a - b);
        this.floor = Math.max(LEAST_FLOOR_DB, levels[Math.floor(0.9 * levels.length)]);
        this.quiet = null;
      }
      return;
    }
    const softest = this.floor + OVER_ROOM_DB;
    const isLoud = level > softest;
    const isVoiced = isLoud && this.periodicity() > VOICED;
    const isHeardThrough = this.isOpen && deep > DEEP_SHARE * all;
    const isWind = isLoud && (!isVoiced || isHeardThrough) && low > WIND_SHARE * all;
    this.unvoiced = isVoiced ? 0 : this.unvoiced + STEP_S;
    this.wind = isWind ? this.wind + STEP_S : Math.max(0, this.wind - 2 * STEP_S);
    this.calm = isWind ? 0 : this.calm + STEP_S;
    if (!this.isOpen && this.wind >= ONSET_S && this.unvoiced >= UNVOICED_S) this.isOpen = true;
    if (this.isOpen && this.calm >= CLOSE_S) [this.isOpen, this.wind] = [false, 0];
    if (this.isOpen) this.loud = Math.max(this.loud, blown);
    const loudest = Math.max(this.loud, softest + 12);
    const wanted = this.isOpen ? Math.min(1, Math.max(0.05, (blown - softest) / (loudest - softest))) : 0;
    const time = wanted > this.breath ? UP_S : DOWN_S;
    this.breath += (1 - Math.exp(-STEP_S / time)) * (wanted - this.breath);
    if (this.breath < 1e-3) this.breath = 0;
  }
}
