// Numbers as they are printed.

/** The digits of `ist query`, with trailing zeros, so that columns do not move. */
export function digits(x, count = 6) {
  if (x === 0) return '0';
  const exponent = Number(x.toExponential(count - 1).split('e')[1]);
  if (exponent >= -3 && exponent < count) return minus(x.toFixed(count - 1 - exponent));
  const [mantissa, power] = x.toExponential(count - 1).split('e');
  return minus(`${mantissa}e${Number(power)}`);
}

/** Three numbers, as coarse as the largest of them allows. */
export function vector(v, count = 4) {
  const size = Math.max(...Array.from(v, Math.abs));
  if (size === 0) return '(0, 0, 0)';
  const exponent = Math.floor(Math.log10(size));
  if (exponent >= count || exponent < -4) {
    return `(${Array.from(v, (x) => digits(x, count - 1)).join(', ')})`;
  }
  const places = Math.max(0, Math.min(count - 1 - exponent, 8));
  return `(${Array.from(v, (x) => minus((x || 0).toFixed(places))).join(', ')})`;
}

export const whole = (x) => Math.round(x).toLocaleString('en').replaceAll('.', ',');

/** From … to, with a single power of ten. */
export function range(low, high, count = 6) {
  if (high === 0) return '0';
  const [a, b] = [digits(low, count), digits(high, count)];
  const [mantissaA, powerA] = a.split('e'), [mantissaB, powerB] = b.split('e');
  return powerA && powerA === powerB ? `(${mantissaA} … ${mantissaB})e${powerA}` : `${a} … ${b}`;
}

const minus = (text) => text.replaceAll('-', '−').replace(/^−(0(\.0*)?)$/, '$1');
