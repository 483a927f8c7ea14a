// What all that is dragged and chosen has in common.

/** A mouse, and a finger, that has moved by less than this has only touched, pixels. */
const [STILL, STILL_FINGER] = [4, 6];

/** Whether a pointer has moved on from where it went down. */
export function hasMoved(now, from) {
  const least = now.pointerType === 'mouse' ? STILL : STILL_FINGER;
  return Math.hypot(now.clientX - from.clientX, now.clientY - from.clientY) >= least;
}

/** The first button of a mouse, a finger, or the tip of a pen. */
export const isMain = (event) => event.button === 0;

let wasPointer = false;
addEventListener('pointerdown', () => (wasPointer = true), { capture: true });
addEventListener('keydown', () => (wasPointer = false), { capture: true });

/** The computer's keys are for playing again after an element was used by a pointer. Who uses it by keys keeps it. */
export function leaveAfterPointer(element) {
  if (wasPointer) element.blur();
}
