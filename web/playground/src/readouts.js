// The numbers beside the view, and the same in words.

import {digits, range, vector, whole} from './format.js';

const kRows = [
  ['volume', 'Volume', 'u³', 'main'],
  ['sum', 'Interval of the sum', 'u³'],  // it says nothing of the true volume
  ['distance', 'Distance', 'u'],
  ['force', 'Force / k', 'u²'],
  ['forceVector', '', '', 'detail'],
  ['torque', 'Torque / k', 'u³'],
  ['torqueVector', '', '', 'detail'],
  ['pairs', 'Sphere pairs', ''],
  ['query', 'Query', 'µs'],
];
const kOften = 100;  // [ms] numbers are written at most so often
const kCalm = 900;   // [ms] words are said once nothing moved for so long
const kFew = 10;     // queries of which a mean is taken
const kMean = 1000;  // [ms] over which times of queries are averaged: a browser's clock is coarse

export class Readouts {
  constructor(list, live) {
    this.live = live;
    this.cells = {};
    for (const [key, label, unit, style] of kRows) {
      const row = document.createElement('div');
      row.className = style ?? '';
      const cell = (tag, text, className) => {
        const made = Object.assign(document.createElement(tag), {textContent: text, className});
        row.append(made);
        return made;
      };
      cell('dt', label, '');
      this.cells[key] = cell('dd', '–', '');
      this.cells[key].id = `read-${key}`;
      cell('dd', unit, 'unit');
      list.append(row);
    }
    this.written = -Infinity;
    this.times = {since: 0, sum: 0, count: 0};
  }

  /** After every query; `now` [ms]. */
  note(contact, now) {
    this.contact = contact;
    this.changed = now;
    this.said = false;
    const touching = contact.penetration.volume > 0;
    document.body.classList.toggle('touching', touching);
    document.body.classList.toggle('apart', !touching && contact.separation.distance > 0);
    const times = this.times;
    times.sum += contact.time;
    ++times.count;
    this.stale = true;
  }

  /** Every frame: writes what is due. */
  tick(now) {
    if (this.stale && now - this.written >= kOften) this.write(now);
    if (this.contact && !this.said && now - this.changed > kCalm) {
      this.say(this.words());
      this.said = true;
    }
  }

  write(now) {
    const {penetration: p, separation: s} = this.contact, {cells, times} = this;
    this.stale = false;
    this.written = now;
    const put = (key, text) => {
      if (cells[key].textContent !== text) cells[key].textContent = text;
    };
    put('volume', digits(p.volume));
    put('sum', range(p.volumeMin, p.volumeMax));
    put('distance', range(s.distanceMin, s.distanceMax, 5));
    put('force', digits(Math.hypot(...p.force)));
    put('forceVector', vector(p.force));
    put('torque', digits(Math.hypot(...p.torque)));
    put('torqueVector', vector(p.torque));
    put('pairs', whole(p.spherePairs));
    if (this.contact !== times.of) {
      Object.assign(times, {of: this.contact, since: now, sum: 0, count: 0});
      put('query', whole(1000 * this.contact.usual));
    } else if (now - times.since > kMean && times.count >= kFew) {
      put('query', whole(1000 * times.sum / times.count));
      Object.assign(times, {since: now, sum: 0, count: 0});
    }
  }

  words() {
    const {penetration: p, separation: s} = this.contact;
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

  say(text) {
    // The same words again are said again.
    this.live.textContent = this.live.textContent === text ? `${text} ` : text;
  }
}
