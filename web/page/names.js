// Names of notes, as clarinettists write them.

const NAMES = ['C', 'C♯', 'D', 'E♭', 'E', 'F', 'F♯', 'G', 'G♯', 'A', 'B♭', 'B'];

/** The name of a MIDI note number: 60 is C4. */
export const noteName = (note) => `${NAMES[note % 12]}${Math.floor(note / 12) - 1}`;

/** Whether it is a black key. */
export const isBlack = (note) => [1, 3, 6, 8, 10].includes(note % 12);

/** A file of the page as JSON. */
export async function json(file) {
  const answer = await fetch(file);
  if (!answer.ok) throw new Error(`${file} is missing (${answer.status}). Build the page again with cargo xtask web.`);
  return answer.json();
}

export const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
