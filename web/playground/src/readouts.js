// The numbers beside the view, and the same in words.

import {digits, range, vector, whole} from './format.js';

// [name, label, unit, kind] of the rows for meshes and spheres; `wide` rows are for both.
const kRows = [
  ['volume', 'Volume', 'u³', 'main'],
  ['error', 'Error', '%'],
  ['force', 'Force / k', 'u²'],
  ['forceVector', '', '', 'wide detail'],
  ['torque', 'Torque / k', 'u³'],
  ['torqueVector', '', '', 'wide detail'],
  ['time', 'Time', 'µs'],
  ['distance', 'Distance', 'u', 'wide'],
];
const kOften = 100;  // [ms] numbers are written at most so often
const kCalm = 900;   // [ms] words are said once nothing moved for so long

/** The readouts of a contact: written often, and announced once nothing moves. */
export class Told {
  constructor(live) {
    this.live = live;
    this.written = -Infinity;
  }

  /** After every query; `now` [ms]. */
  note(contact, now, touching, apart = false) {
    this.contact = contact;
    this.changed = now;
    this.said = false;
    document.body.classList.toggle('touching', touching);
    document.body.classList.toggle('apart', apart);
    this.stale = true;
  }

  /** Every frame: writes due readouts. */
  tick(now) {
    if (this.stale && now - this.written >= kOften) this.write(now);
    if (this.contact && !this.said && now - this.changed > kCalm) {
      this.say(this.words());
      this.said = true;
    }
  }

  write(now) {
    this.stale = false;
    this.written = now;
  }

  say(text) {
    // Repeated words are announced again.
    this.live.textContent = this.live.textContent === text ? `${text} ` : text;
  }
}

export class Readouts extends Told {
  constructor(table, live) {
    super(live);
    this.cells = {};
    for (const [key, label, unit, style = ''] of kRows) {
      const row = table.insertRow();
      row.className = style;
      row.append(Object.assign(document.createElement('th'), {textContent: label, scope: 'row'}));
      const wide = style.includes('wide');
      for (const name of wide ? [key] : [key, `${key}-spheres`]) {
        const cell = this.cells[name] = row.insertCell();
        Object.assign(cell, {id: `read-${name}`, textContent: '–', colSpan: wide ? 2 : 1});
      }
      row.insertCell().textContent = unit;
    }
  }

  note(contact, now) {
    const touching = contact.best.volume > 0;
    super.note(contact, now, touching, !touching && contact.separation.distance > 0);
  }

  /** Once times were taken. */
  noteTimes({times, hasMeshes}) {
    this.put('time', hasMeshes ? whole(1000 * times.exact) : '–');
    this.put('time-spheres', whole(1000 * times.spheres));
  }

  put(key, text) {
    const cell = this.cells[key];
    if (cell.textContent !== text) cell.textContent = text;
  }

  write(now) {
    super.write(now);
    const {exact, spheres, best, separation: s} = this.contact;
    for (const [p, key] of [[exact, ''], [spheres, '-spheres']]) {
      this.put(`volume${key}`, p ? digits(p.volume) : '–');
      this.put(`force${key}`, p ? digits(Math.hypot(...p.force)) : '–');
      this.put(`torque${key}`, p ? digits(Math.hypot(...p.torque)) : '–');
    }
    this.put('error', exact ? '0' : '–');
    this.put('error-spheres', exact?.volume > 0 ? error(spheres.volume, exact.volume) : '–');
    for (const key of ['force', 'torque']) {
      this.put(`${key}Vector`, vector(best[key]));
      this.cells[`${key}Vector`].previousSibling.textContent = exact ? 'exact' : 'spheres';
    }
    this.put('distance', range(s.distanceMin, s.distanceMax, 5));
  }

  words() {
    const {best: p, separation: s} = this.contact;
    if (p.volume > 0) {
      return `Overlap ${digits(p.volume, 4)} cubic units; force ${
                 digits(Math.hypot(...p.force), 4)}, ` +
          `direction ${vector(p.force.map((x) => x / Math.hypot(...p.force)), 2)}.`;
    }
    if (s.distanceMax > 0) {
      return `Apart by ${digits(s.distanceMin, 3)} to ${digits(s.distanceMax, 3)} units.`;
    }
    return 'Touching, without measurable overlap.';
  }
}

/** Of a volume, in per cent of the true one, with its sign. */
const error = (volume, truth) => {
  const percent = 100 * (volume / truth - 1);
  return `${percent > 0 ? '+' : ''}${digits(percent, 2)}`;
};
