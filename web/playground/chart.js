// The trade between spheres and error as an SVG: a line for each class of overlap.

const kWidth = 860, kHeight = 400, kLeft = 76, kRight = 150, kTop = 20, kBottom = 54;
const kColours = ['#12436d', '#2073bc', '#28a197', '#d99a2b', '#c8443a'];

/** `rows`: {class, spheres, error} in percent. */
export function chart(rows, foot) {
  const classes = [...new Set(rows.map((row) => row.class))];
  const scale = (values, from, to) => {
    const low = Math.log10(Math.min(...values)), high = Math.log10(Math.max(...values));
    const [a, b] = [Math.floor(low), Math.ceil(high)];
    const place = (v) => from + (to - from) * (Math.log10(v) - a) / (b - a);
    return {place, ticks: Array.from({length: b - a + 1}, (_, k) => 10 ** (a + k))};
  };
  const x = scale(rows.map((row) => row.spheres), kLeft, kWidth - kRight);
  const y = scale(rows.map((row) => row.error), kHeight - kBottom, kTop);
  const label = (v) => v >= 1 ? v.toLocaleString('en') : String(Number(v.toPrecision(1)));
  const grid = [
    ...x.ticks.map(
        (v) => `<line x1="${x.place(v)}" x2="${x.place(v)}" y1="${kTop}" y2="${kHeight - kBottom}"/>
      <text x="${x.place(v)}" y="${kHeight - kBottom + 20}" text-anchor="middle">${
            label(v)}</text>`),
    ...y.ticks.map(
        (v) => `<line x1="${kLeft}" x2="${kWidth - kRight}" y1="${y.place(v)}" y2="${y.place(v)}"/>
      <text x="${kLeft - 8}" y="${y.place(v) + 4}" text-anchor="end">${label(v)} %</text>`),
  ];
  // Names at the ends of their lines, apart from each other.
  let below = Infinity;
  const ends =
      classes
          .map((name, k) => {
            const own =
                rows.filter((row) => row.class === name).sort((a, b) => a.spheres - b.spheres);
            return {name, own, colour: kColours[k % kColours.length], y: y.place(own.at(-1).error)};
          })
          .sort((a, b) => b.y - a.y)
          .map((line) => ({...line, at: below = Math.min(line.y, below - 18)}));
  const lines = ends.map(({name, own, colour, at}) => {
    const points = own.map((row) => [x.place(row.spheres), y.place(row.error)]);
    return `<polyline points="${points.join(' ')}" fill="none" stroke="${
        colour}" stroke-width="2.2"/>
      ${points.map(([a, b]) => `<circle cx="${a}" cy="${b}" r="3.4" fill="${colour}"/>`).join('')}
      <text x="${kWidth - kRight + 12}" y="${at + 4}" style="fill: ${colour}">${name}</text>`;
  });
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${kWidth}" height="${kHeight}" id="picture"
      style="font: 14px 'DejaVu Sans', sans-serif; background: #fff; display: block">
    <style>line { stroke: #e2e5e9 } text { fill: #4a525c }</style>
    ${grid.join('')}${lines.join('')}
    <text x="${(kLeft + kWidth - kRight) / 2}" y="${kHeight - 10}" text-anchor="middle">${
      foot}</text>
  </svg>`;
}
