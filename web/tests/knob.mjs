// A knob for the browser's tests: a double of navigator.serial, fed by a test, or by the simulator that runs the real firmware.

import { spawn } from 'node:child_process';
import { createHash } from 'node:crypto';
import { openSync, readFileSync, writeSync } from 'node:fs';
import { createServer } from 'node:http';
import { ReadStream } from 'node:tty';

/** A port in place of the browser's. It speaks to `address`, or, without one, only to the test: `serialPort.feed`, `serialPort.written`. */
export const serialPort = (address, number) => `(() => {
  const port = { written: [], speeds: [], isOpen: false };
  const feed = (bytes) => port.isOpen && port.controller?.enqueue(Uint8Array.from(bytes));
  port.feed = feed;
  const stream = () => { port.readable = new ReadableStream({ start: (controller) => { port.controller = controller; } }); };
  // A break or a damaged byte ends one stream, and the port goes on with another.
  port.disturb = () => { const { controller } = port; stream(); controller.error(new Error('A framing error has occurred.')); };
  port.getInfo = () => ({ usbVendorId: 0x303a, usbProductId: 0x1001 });
  port.open = async ({ baudRate }) => {
    if (port.isOpen) throw new Error('already open');
    port.speeds.push(baudRate);
    port.isOpen = true;
    stream();
    port.writable = new WritableStream({ write: (bytes) => {
      port.written.push(...bytes);
      port.socket?.send(bytes);
    } });
    if (!${JSON.stringify(address ?? null)}) return;
    port.socket = new WebSocket(${JSON.stringify(address ?? '')});
    port.socket.binaryType = 'arraybuffer';
    port.socket.onmessage = ({ data }) => feed(new Uint8Array(data));
    await new Promise((ready) => { port.socket.onopen = ready; });
  };
  port.setSignals = async () => {};
  port.close = async () => { port.isOpen = false; port.socket?.close(); };
  // It stays open, as far as its owner knows, until it is closed.
  port.unplug = () => { port.readable = null; port.controller.error(new Error('The device has been lost.')); port.socket?.close(); };
  globalThis.serialPort = port;
  Object.defineProperty(navigator, 'serial', { value: { requestPort: async () => port, getPorts: async () => [port], addEventListener() {} } });
  const random = ${JSON.stringify(number ?? null)};
  if (random !== null) crypto.getRandomValues = (array) => array.fill(random);
})()`;

const GOLDEN = new URL('../../firmware/golden/', import.meta.url);
/** The frames that both ends must agree on: name, verdict and bytes. */
export function goldenFrames() {
  const lines = readFileSync(new URL('list.tsv', GOLDEN), 'utf8').trim().split('\n').slice(1);
  return lines.map((line) => {
    const [file, verdict, , , , , hex] = line.split('\t');
    return { name: file.replace('.bin', ''), verdict, bytes: [...Buffer.from(hex, 'hex')] };
  });
}

/** Types of the frames in a stream of bytes. */
export function typesOf(bytes) {
  const types = [];
  for (let from = 0, at = 0; at < bytes.length; at += 1) {
    if (bytes[at] !== 0) continue;
    // COBS: the first byte counts to the first zero, and no type is zero.
    if (at - from > 1) types.push(bytes[from + 1]);
    from = at + 1;
  }
  return types;
}

/** Follows the STATE frames in a stream: torque in mNm, angle in degrees, and whether the knob is armed. */
function stateReader(on) {
  let run = [];
  return (bytes) => {
    for (const byte of bytes) {
      if (byte !== 0) {
        run.push(byte);
        continue;
      }
      const plain = [];
      for (let at = 0; at < run.length; at += run[at]) {
        plain.push(...run.slice(at + 1, at + run[at]));
        if (at + run[at] < run.length) plain.push(0);
      }
      run = [];
      if (plain[0] !== 0x82 || plain.length < 26) continue;
      const view = new DataView(Uint8Array.from(plain).buffer, 2);
      on({ at: performance.now(), angle: view.getInt32(4, true) / 100, torque: Math.abs(view.getInt16(10, true)), armed: (view.getUint16(12, true) & 1) === 1 });
    }
  };
}

/** One WebSocket of the test (RFC 6455), for the bytes of a port: frames are short and never masked by a server. */
function bridge(server, onBytes) {
  const sockets = new Set();
  server.on('upgrade', (request, socket) => {
    const key = createHash('sha1').update(`${request.headers['sec-websocket-key']}258EAFA5-E914-47DA-95CA-C5AB0DC85B11`).digest('base64');
    socket.write(`HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: ${key}\r\n\r\n`);
    socket.setNoDelay(true);
    sockets.add(socket);
    let had = Buffer.alloc(0);
    socket.on('data', (data) => {
      had = Buffer.concat([had, data]);
      for (;;) {
        const long = had.length >= 2 && (had[1] & 127) === 126;
        const head = long ? 8 : 6;
        if (had.length < head) return;
        const length = long ? had.readUInt16BE(2) : had[1] & 127;
        if (had.length < head + length) return;
        const mask = had.subarray(head - 4, head);
        const body = had.subarray(head, head + length).map((byte, n) => byte ^ mask[n % 4]);
        if ((had[0] & 15) === 2) onBytes(body);
        had = had.subarray(head + length);
      }
    });
    for (const end of ['close', 'error']) socket.on(end, () => sockets.delete(socket));
  });
  return (bytes) => {
    const head = bytes.length < 126 ? Buffer.from([0x82, bytes.length]) : Buffer.from([0x82, 126, bytes.length >> 8, bytes.length & 255]);
    sockets.forEach((socket) => socket.write(Buffer.concat([head, bytes])));
  };
}

/** Starts `chalumeau knob-sim` with these words, bridged to a WebSocket. */
export async function simulator(program, ...words) {
  const child = spawn(program, ['knob-sim', '--quiet', ...words], { stdio: ['ignore', 'pipe', 'inherit'] });
  const path = await new Promise((found, none) => {
    child.stdout.on('data', (text) => {
      const [, path] = /^serial (\S+)/m.exec(text) ?? [];
      if (path) found(path);
    });
    child.on('exit', () => none(new Error('the simulator has ended')));
  });
  const terminal = openSync(path, 'r+');
  const server = createServer();
  const send = bridge(server, (bytes) => {
    try {
      writeSync(terminal, bytes);
    } catch {
      // A full line drops what does not fit, as a driver does.
    }
  });
  const states = [];
  const follow = stateReader((state) => states.push(state));
  const reading = new ReadStream(terminal);
  reading.on('data', (bytes) => {
    follow(bytes);
    send(bytes);
  });
  reading.on('error', () => {});
  await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
  return {
    address: `ws://127.0.0.1:${server.address().port}/`,
    /** What the knob has said, on the clock of this process. */
    states,
    /** The first state from `since` on of which something holds, ms after it; waits for it. */
    async until(holds, since, patience = 5000) {
      for (;;) {
        const found = states.find((state) => state.at >= since && holds(state));
        if (found) return found.at - since;
        if (performance.now() - since > patience) return Infinity;
        await new Promise((later) => setTimeout(later, 5));
      }
    },
    async end() {
      child.kill('SIGINT');
      await new Promise((ended) => child.on('exit', ended));
      reading.destroy();
      server.close();
      server.closeAllConnections();
    },
  };
}
