// Sound: the audio context, the worklet with the module, the microphone.

import { compiled, gainOfShare, whySilent } from './sound.js';

/** Rate for what asks before there is sound, or where there is none, Hz. */
const USUAL_HZ = 48000;

/** Sees to it that what plays is heard: from the page's loading on everything is prepared, and the first gesture starts it. */
export class Engine {
  /** `on` gets { picture }, { blowing }, { failed }, { state: of the context }, and whatever else the worklet tells. */
  constructor(on) {
    this.on = on;
    this.instrument = 0;
    this.waiting = [];
    this.prepared = new Promise((resolve, reject) => Object.assign(this, { tellPrepared: resolve, tellFailed: reject }));
    // Who waits for it is told; where nobody waits, `prepare` has told already.
    this.prepared.catch(() => {});
    this.trouble = whySilent();
    if (this.trouble) return;
    try {
      // Its sample rate is needed before the module is here: what a worker prepares is for that rate.
      this.context = new AudioContext({ latencyHint: 'interactive' });
      this.context.onstatechange = () => this.on({ state: this.context.state });
    } catch (error) {
      this.trouble = `the browser gives no sound (${error.message})`;
    }
  }

  /** Fetches and compiles the module, and makes the worklet; silent until `start`. */
  async prepare() {
    try {
      await this.make();
    } catch (error) {
      this.trouble = error.message;
      this.waiting = [];
      this.tellFailed(error);
      throw error;
    }
    this.tellPrepared();
    if (this.wanted) await this.start();
  }

  async make() {
    if (this.trouble) throw Object.assign(new Error(this.trouble), { isLasting: true });
    const module = await compiled('chalumeau.wasm');
    this.volume = new GainNode(this.context, { gain: this.gain ?? 0.8 });
    this.volume.connect(this.context.destination);
    await this.context.audioWorklet.addModule('worklet.js');
    this.node = new AudioWorkletNode(this.context, 'chalumeau', {
      numberOfInputs: 1,
      numberOfOutputs: 1,
      outputChannelCount: [2],
      channelCount: 1,
      channelCountMode: 'explicit',
      processorOptions: { module, instrument: this.instrument },
    });
    this.node.port.onmessage = ({ data }) => this.on(data);
    this.node.onprocessorerror = () => this.on({ failed: 'the audio thread stopped' });
    this.node.connect(this.volume);
    this.waiting.forEach((message) => this.node.port.postMessage(message));
    this.waiting = [];
  }

  /** Called in a gesture of the user: browsers let a page sound only then. Where they do not, this may wait for ever. */
  async start() {
    this.wanted = true;
    this.askSession();
    if (this.context && !this.isRunning) await this.context.resume();
  }

  /** On a telephone, an instrument sounds even where its ringing is muted. There a page must say that it records before it may. */
  askSession() {
    if (navigator.audioSession) navigator.audioSession.type = this.hears ? 'play-and-record' : 'playback';
  }

  /** Switches the sound off until the next `start`. */
  rest() {
    this.wanted = false;
    if (this.isRunning) this.context.suspend();
  }

  get isRunning() {
    return this.context?.state === 'running';
  }

  get sampleRate() {
    return this.context?.sampleRate ?? USUAL_HZ;
  }

  send(message) {
    if (this.node) this.node.port.postMessage(message);
    else if (!this.trouble) this.waiting.push(message);
  }

  /** 0..=1; the ear hears the square. */
  setVolume(share) {
    this.gain = gainOfShare(share);
    this.volume?.gain.setTargetAtTime(this.gain, this.context.currentTime, 0.015);
  }

  /** Opens the microphone as it is: what a call would take away is what is wanted. Measures the room for two seconds. */
  async openMicrophone() {
    await this.prepared;
    const raw = { echoCancellation: false, noiseSuppression: false, autoGainControl: false, channelCount: 1 };
    this.hears = true;
    this.askSession();
    try {
      this.stream = await navigator.mediaDevices.getUserMedia({ audio: raw });
      this.input = new MediaStreamAudioSourceNode(this.context, { mediaStream: this.stream });
      this.input.connect(this.node);
    } catch (error) {
      this.closeMicrophone();
      throw error;
    }
    // Unplugged, or taken away by the system.
    this.stream.getTracks().forEach((track) => (track.onended = () => this.on({ microphoneGone: true })));
    this.send({ microphone: true, calibrate: true });
  }

  closeMicrophone() {
    this.send({ microphone: false });
    this.input?.disconnect();
    this.stream?.getTracks().forEach((track) => track.stop());
    [this.input, this.stream, this.hears] = [null, null, false];
    this.askSession();
  }
}
