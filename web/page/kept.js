// What a visit leaves for the next one, in the browser's own store. What is broken or of another version counts for nothing.

/** Another copy of the page, in another folder, has a store of its own. */
const NAME = `chalumeau${new URL('.', location.href).pathname.replace(/\/$/, '')}`;

const within = (value, least, most) => typeof value === 'number' && value >= least && value <= most;

function found() {
  try {
    return JSON.parse(localStorage.getItem(NAME)) ?? {};
  } catch {
    // As if there were nothing.
    return {};
  }
}

export const Kept = {
  /** The volume, 0..100, if it was ever set. */
  volume() {
    const { volume } = found();
    return within(volume, 0, 100) ? volume : undefined;
  },

  keepVolume(volume) {
    Kept.write({ ...found(), volume });
  },

  write(state) {
    try {
      localStorage.setItem(NAME, JSON.stringify(state));
    } catch {
      // A browser that keeps nothing plays all the same.
    }
  },

  /** As far as it fits `data`: places of preset and instrument, pairs of a control and its value, holes, volume. */
  read(data) {
    const state = found();
    const place = (all, fits) => (all.findIndex(fits) < 0 ? undefined : all.findIndex(fits));
    const instrument = place(data.instruments, ({ id }) => id === state.instrument);
    const { length, holes } = data.instruments[instrument] ?? { holes: [] };
    const fits = (hole) => holes.some(({ name }) => name === hole?.name) && within(hole.x_m, data.holes.least_x, length) && within(hole.radius_m, ...data.holes.radius);
    return {
      preset: place(data.presets, ({ name }) => name === state.preset),
      instrument,
      controls: data.controls.map((control) => [control, state.controls?.[control.id]]).filter(([{ min, max }, value]) => within(value, min, max)),
      moved: (Array.isArray(state.moved) ? state.moved : []).filter(fits).map(({ name, x_m, radius_m }) => ({ name, x_m, radius_m })),
      volume: within(state.volume, 0, 100) ? state.volume : undefined,
    };
  },
};
