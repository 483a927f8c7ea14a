// Sound: the audio context, the worklet with the module, the microphone.

/** Sees to it that what plays is heard: from the page's loading on everything is prepared, and the first gesture starts it. */
export class Engine {
  /** `on` gets { picture }, { blowing }, { failed }, and whatever else the worklet tells. */
  constructor(on) {
    this.on = on;
    this.instrument = 0;
    this.waiting = [];
    // Its sample rate is needed before the module is here: what a worker prepares is for that rate.
    this.context = new AudioContext({ latencyHint: 'interactive' });
    this.prepared = new Promise((resolve) => (this.tellPrepared = resolve));
  }

  /** Fetches and compiles the module, and makes the worklet; silent until `start`. */
  async prepare() {
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
    this.tellPrepared();
    if (this.wanted) await this.start();
  }

  /** Called in a gesture of the user: browsers let a page sound only then. */
  async start() {
    this.wanted = true;
    if (this.context.state !== 'running') await this.context.resume();
  }

  /** Switches the sound off until the next `start`. */
  rest() {
    if (this.isRunning) this.context.suspend();
  }

  get isRunning() {
    return this.context.state === 'running';
  }

  send(message) {
    if (this.node) this.node.port.postMessage(message);
    else this.waiting.push(message);
  }

  /** 0..=1; the ear hears the square. */
  setVolume(share) {
    this.gain = share * share * 1.25;
    this.volume?.gain.setTargetAtTime(this.gain, this.context.currentTime, 0.015);
  }

  /** Opens the microphone as it is: what a call would take away is what is wanted. Measures the room for two seconds. */
  async openMicrophone() {
    await this.prepared;
    const raw = { echoCancellation: false, noiseSuppression: false, autoGainControl: false, channelCount: 1 };
    this.stream = await navigator.mediaDevices.getUserMedia({ audio: raw });
    try {
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
    [this.input, this.stream] = [null, null];
  }
}

async function compiled(address) {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error(`${address}: ${answer.status}`);
  // A host that calls the file something else than application/wasm must not matter.
  return WebAssembly.compile(await answer.arrayBuffer());
}
