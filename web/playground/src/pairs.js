// The pairs of parts that meet, as a list beside the view, and the same in words.

import {digits, whole} from './format.js';
import {Told} from './readouts.js';

const kNew =
    1500;  // [ms] a pair is said to begin for so long, and one that ended stays in the list

export class Pairs extends Told {
  constructor(body, time, live) {
    super(live);
    this.body = body;
    this.timeTold = time;
    this.rows = new Map();  // by pair
  }

  note(tray, now) {
    super.note(tray, now, tray.ranked().some(({volume}) => volume > 0));
  }

  noteTimes({stepTime}) {
    this.timeTold.textContent = whole(1000 * stepTime);
  }

  write(now) {
    super.write(now);
    const tray = this.contact;
    for (const [key, pair] of tray.pairs) {
      if (!(now - pair.ended > kNew)) continue;
      pair.overlap?.group.removeFromParent();
      tray.pairs.delete(key);
      this.rows.get(pair)?.remove();
      this.rows.delete(pair);
    }
    const ranked = tray.ranked();
    ranked.forEach((pair, i) => {
      const row = this.row(pair), fresh = now - pair.began < kNew;
      const event = pair.ended !== undefined ? 'ended' : fresh ? 'begins' : 'stays';
      this.stale ||= event !== 'stays';
      if (this.body.rows[i] !== row) this.body.insertBefore(row, this.body.rows[i] ?? null);
      const apart = !(pair.volume > 0);
      const words = [
        `${pair.a.name}, ${pair.b.name}`,
        event === 'ended' ? '–' :
            apart         ? nearness(pair) :
                            digits(pair.volume, 4),
        apart ? '' : digits(pair.force, 4),
        event,
      ];
      words.forEach((text, k) => {
        if (row.cells[k].textContent !== text) row.cells[k].textContent = text;
      });
      row.cells[1].colSpan = apart ? 2 : 1;
      row.cells[2].hidden = apart;
      row.className = `${event}${apart ? ' apart' : ''}`;
    });
  }

  row(pair) {
    let row = this.rows.get(pair);
    if (row) return row;
    row = document.createElement('tr');
    row.append(Object.assign(document.createElement('th'), {scope: 'row'}));
    for (let i = 0; i < 3; ++i) row.insertCell();
    this.rows.set(pair, row);
    return row;
  }

  words() {
    const meeting = this.contact.ranked().filter(({volume}) => volume > 0);
    if (meeting.length === 0) return 'No parts overlap.';
    const [{a, b, volume}] = meeting;
    return `${
               meeting.length === 1 ? 'One pair overlaps' :
                                      `${meeting.length} pairs overlap`}, most ` +
        `${a.name} and ${b.name}: ${digits(volume, 4)} cubic units.`;
  }
}

/** Of a pair that does not overlap. */
const nearness = ({volume, gap}) => gap > 0 ? `gap ${digits(gap, 2)} u` :
    volume === 0 ? 'touching' :
                   'unknown';
