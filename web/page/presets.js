// The presets: one after another, or by name in a list that can be searched.

export class Presets {
  /** `choose` gets a preset. */
  constructor(all, choose) {
    Object.assign(this, { all, choose, at: 0 });
    const get = (id) => document.getElementById(id);
    [this.dialog, this.search, this.list] = ['browser', 'search', 'list'].map(get);
    get('previous').onclick = () => this.go(this.at - 1);
    get('next').onclick = () => this.go(this.at + 1);
    get('browse').onclick = () => this.open();
    this.search.oninput = () => this.fill();
    // Enter takes the first that is found.
    this.search.onkeydown = (event) => {
      if (event.key !== 'Enter') return;
      event.preventDefault();
      this.list.querySelector('button')?.click();
    };
    this.dialog.addEventListener('click', (event) => event.target === this.dialog && this.dialog.close());
    this.show();
  }

  go(at) {
    this.at = (at + this.all.length) % this.all.length;
    this.show();
    this.choose(this.all[this.at]);
  }

  show() {
    const { name, tags, shows } = this.all[this.at];
    document.getElementById('preset').textContent = name;
    document.getElementById('tags').textContent = tags.join(' · ');
    document.getElementById('browse').title = shows;
  }

  /** The settings are no longer those of the preset. */
  change() {
    document.getElementById('tags').textContent = ['changed', ...this.all[this.at].tags].join(' · ');
  }

  open() {
    this.search.value = '';
    this.fill();
    this.dialog.showModal();
    this.list.querySelector('[aria-current=true]')?.scrollIntoView({ block: 'center' });
  }

  fill() {
    const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const has = (text) => words.every((word) => text.toLowerCase().includes(word));
    // Enter takes the first: names go before tags, and these before words that happen to be said.
    const texts = ({ name, tags, shows }) => [name.toLowerCase().includes(words.join(' ')) ? name : '', name, `${name} ${tags.join(' ')}`, `${name} ${tags.join(' ')} ${shows}`];
    const rank = (preset) => texts(preset).findIndex(has);
    const found = this.all.map((preset, at) => ({ ...preset, at, rank: rank(preset) })).filter((preset) => preset.rank >= 0);
    found.sort((a, b) => a.rank - b.rank || a.at - b.at);
    this.list.replaceChildren(...found.map((preset) => this.row(preset)));
    if (found.length === 0) this.list.append(Object.assign(document.createElement('li'), { textContent: 'No preset has all these words.', className: 'quiet' }));
  }

  row({ name, tags, shows, at }) {
    const button = document.createElement('button');
    button.setAttribute('aria-current', at === this.at);
    const part = (kind, textContent) => Object.assign(document.createElement(kind), { textContent });
    button.append(part('i', tags.join(' · ')), name, part('small', shows));
    button.onclick = () => {
      this.dialog.close();
      this.go(at);
    };
    const row = document.createElement('li');
    row.append(button);
    return row;
  }
}
