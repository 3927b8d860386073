// A quantity over the last seconds, on a canvas.

import {digits} from './format.js';

const kSeconds = 10;
const kMost = 2048;  // samples

export class Plot {
  constructor(canvas, told, unit) {
    Object.assign(this, {canvas, told, unit});
    this.times = new Float64Array(kMost);
    this.values = new Float64Array(kMost);
    this.clear();
  }

  clear() {
    this.first = this.count = 0;
    this.dirty = true;
  }

  add(now, value) {
    const at = (this.first + this.count) % kMost;
    this.times[at] = now;
    this.values[at] = value;
    if (this.count < kMost)
      ++this.count;
    else
      this.first = (this.first + 1) % kMost;
    this.dirty = true;
  }

  draw(now, colour) {
    if (!this.dirty) return;
    const {canvas} = this, ratio = Math.min(devicePixelRatio, 2);
    const width = Math.round(canvas.clientWidth * ratio);
    const height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    const pen = canvas.getContext('2d');
    pen.clearRect(0, 0, width, height);
    while (this.count > 1 && now - this.times[this.first] > 1000 * kSeconds) {
      this.first = (this.first + 1) % kMost;
      --this.count;
    }
    let most = 0;
    for (let i = 0; i < this.count; ++i)
      most = Math.max(most, this.values[(this.first + i) % kMost]);
    this.told.textContent = most > 0 ? `≤ ${digits(most, 3)} ${this.unit}` : '';
    this.dirty = this.count > 0 && most > 0;
    if (this.count < 2) return;
    const x = (i) => width * (1 - (now - this.times[(this.first + i) % kMost]) / 1000 / kSeconds);
    const y = (i) =>
        height - ratio - (height - 4 * ratio) * this.values[(this.first + i) % kMost] / (most || 1);
    pen.beginPath();
    pen.moveTo(x(0), y(0));
    for (let i = 1; i < this.count; ++i) pen.lineTo(x(i), y(i));
    pen.lineTo(width, y(this.count - 1));
    pen.strokeStyle = colour;
    pen.lineWidth = 1.5 * ratio;
    pen.lineJoin = 'round';
    pen.stroke();
    pen.lineTo(width, height);
    pen.lineTo(x(0), height);
    pen.globalAlpha = 0.12;
    pen.fillStyle = colour;
    pen.fill();
    pen.globalAlpha = 1;
  }
}
