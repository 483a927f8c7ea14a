// What a visit leaves for the next one, in the browser's own store. What is broken or of another version counts for nothing.

const NAME = 'chalumeau';

export const Kept = {
  write(state) {
    try {
      localStorage.setItem(NAME, JSON.stringify(state));
    } catch {
      // A browser that keeps nothing plays all the same.
    }
  },

  /** As far as it fits `data`: places of preset and instrument, pairs of a control and its value, holes, volume. */
  read(data) {
    let found;
    try {
      found = JSON.parse(localStorage.getItem(NAME));
    } catch {
      // As if there were nothing.
    }
    const state = found ?? {};
    const place = (all, fits) => (all.findIndex(fits) < 0 ? undefined : all.findIndex(fits));
    const within = (value, least, most) => typeof value === 'number' && value >= least && value <= most;
    const instrument = place(data.instruments, ({ id }) => id === state.instrument);
    const { length, holes } = data.instruments[instrument] ?? { holes: [] };
    const fits = (hole) => holes.some(({ name }) => name === hole?.name) && within(hole.x_m, data.holes.least_x, length) && within(hole.radius_m, ...data.holes.radius);
    return {
      preset: place(data.presets, ({ name }) => name === state.preset),
      isChanged: state.isChanged === true,
      instrument,
      controls: data.controls.map((control) => [control, state.controls?.[control.id]]).filter(([{ min, max }, value]) => within(value, min, max)),
      moved: (Array.isArray(state.moved) ? state.moved : []).filter(fits).map(({ name, x_m, radius_m }) => ({ name, x_m, radius_m })),
      volume: within(state.volume, 0, 100) ? state.volume : undefined,
    };
  },
};
