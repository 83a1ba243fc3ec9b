/**
 * QR codes (ISO/IEC 18004) of texts up to 213 bytes: byte mode, error correction M, versions 1 to 10.
 *
 * `qrCode` returns the dark modules as rows; the reader needs four light modules around them.
 */

type Grid = boolean[][];

/** By version: error correction bytes of a block, and the data bytes of each block. */
const BLOCKS: readonly (readonly [ecc: number, data: readonly number[]])[] = [
  [10, [16]],
  [16, [28]],
  [26, [44]],
  [18, [32, 32]],
  [24, [43, 43]],
  [16, [27, 27, 27, 27]],
  [18, [31, 31, 31, 31]],
  [22, [38, 38, 39, 39]],
  [22, [36, 36, 36, 37, 37]],
  [26, [43, 43, 43, 43, 44]],
];

/** By version: distance of the last alignment pattern from the first one, which is at 6; from version 7 on, one is between. */
const ALIGNMENT = [0, 12, 16, 20, 24, 28, 32, 36, 40, 44];

const sum = (values: readonly number[]) => values.reduce((all, one) => all + one, 0);

/** Returns the QR code of a text; throws RangeError if it is too long. */
export function qrCode(text: string): Grid {
  const bytes = new TextEncoder().encode(text);
  const version = 1 + BLOCKS.findIndex(([, data], i) => 4 + (i < 9 ? 8 : 16) + 8 * bytes.length <= 8 * sum(data));
  if (version === 0) throw new RangeError("the text is too long for a QR code");
  const bits = toBits(corrected(packed(bytes, version), version));
  const codes = MASKS.map((mask, number) => drawn(version, bits, mask, number)).map((code) => ({ code, penalty: penalty(code) }));
  return codes.reduce((best, one) => (one.penalty < best.penalty ? one : best)).code;
}

/** The data bytes: mode, length, text, end, padding. */
function packed(bytes: Uint8Array, version: number): number[] {
  const capacity = sum((BLOCKS[version - 1] as (typeof BLOCKS)[number])[1]);
  const bits = [...number(4, 4), ...number(bytes.length, version < 10 ? 8 : 16), ...[...bytes].flatMap((one) => number(one, 8))];
  bits.push(...Array<boolean>(Math.min(4, 8 * capacity - bits.length)).fill(false));
  while (bits.length % 8) bits.push(false);
  const found: number[] = [];
  for (let i = 0; i < bits.length; i += 8) found.push(bits.slice(i, i + 8).reduce((all, bit) => 2 * all + Number(bit), 0));
  for (let pad = 0xec; found.length < capacity; pad ^= 0xec ^ 0x11) found.push(pad);
  return found;
}

const number = (value: number, length: number) => Array.from({ length }, (_, i) => ((value >> (length - 1 - i)) & 1) === 1);
const toBits = (bytes: readonly number[]) => bytes.flatMap((one) => number(one, 8));

/** The blocks with their error correction, interleaved. */
function corrected(bytes: number[], version: number): number[] {
  const [ecc, sizes] = BLOCKS[version - 1] as (typeof BLOCKS)[number];
  let from = 0;
  const data = sizes.map((size) => bytes.slice(from, (from += size)));
  const checks = data.map((block) => remainder(block, ecc));
  const woven = (blocks: number[][]) => Array.from({ length: Math.max(...blocks.map((one) => one.length)) }, (_, i) => blocks.flatMap((one) => one.slice(i, i + 1))).flat();
  return [...woven(data), ...woven(checks)];
}

/** Multiplication in GF(256) with the polynomial 0x11d. */
function times(x: number, y: number): number {
  let product = 0;
  for (let i = 7; i >= 0; i--) product = (product << 1) ^ ((product >> 7) * 0x11d) ^ (((y >> i) & 1) * x);
  return product;
}

/** The Reed-Solomon check bytes of a block. */
function remainder(block: readonly number[], length: number): number[] {
  const divisor: number[] = [...Array<number>(length - 1).fill(0), 1];
  for (let root = 1, i = 0; i < length; i++, root = times(root, 2)) {
    divisor.forEach((one, j) => (divisor[j] = times(one, root) ^ (divisor[j + 1] ?? 0)));
  }
  const found = Array<number>(length).fill(0);
  for (const one of block) {
    const factor = one ^ (found.shift() ?? 0);
    found.push(0);
    divisor.forEach((each, i) => (found[i] = (found[i] ?? 0) ^ times(each, factor)));
  }
  return found;
}

const MASKS: readonly ((x: number, y: number) => boolean)[] = [
  (x, y) => (x + y) % 2 === 0,
  (_, y) => y % 2 === 0,
  (x) => x % 3 === 0,
  (x, y) => (x + y) % 3 === 0,
  (x, y) => (Math.floor(x / 3) + Math.floor(y / 2)) % 2 === 0,
  (x, y) => ((x * y) % 2) + ((x * y) % 3) === 0,
  (x, y) => (((x * y) % 2) + ((x * y) % 3)) % 2 === 0,
  (x, y) => (((x + y) % 2) + ((x * y) % 3)) % 2 === 0,
];

/** A code under way: its modules, and which of them belong to patterns and carry no data. */
interface Canvas {
  code: Grid;
  fixed: Grid;
}

function drawn(version: number, bits: readonly boolean[], mask: (x: number, y: number) => boolean, maskNumber: number): Grid {
  const size = 17 + 4 * version;
  const blank = () => Array.from({ length: size }, () => Array<boolean>(size).fill(false));
  const canvas: Canvas = { code: blank(), fixed: blank() };
  drawPatterns(canvas, version);
  drawFormat(canvas, maskNumber);
  if (version >= 7) drawVersion(canvas, version);
  drawData(canvas, bits, mask);
  return canvas.code;
}

/** Sets a module of a pattern; one outside of the code is left out. */
function set({ code, fixed }: Canvas, x: number, y: number, dark: boolean): void {
  const [row, known] = [code[y], fixed[y]];
  if (row === undefined || known === undefined || x < 0 || x >= code.length) return;
  row[x] = dark;
  known[x] = true;
}

/** Draws square rings around a module; `dark` gets the distance of a ring from it. */
function square(canvas: Canvas, x: number, y: number, reach: number, dark: (ring: number) => boolean): void {
  for (let dy = -reach; dy <= reach; dy++) {
    for (let dx = -reach; dx <= reach; dx++) set(canvas, x + dx, y + dy, dark(Math.max(Math.abs(dx), Math.abs(dy))));
  }
}

/** The timing lines, the three finder patterns, and the alignment patterns where no finder pattern is. */
function drawPatterns(canvas: Canvas, version: number): void {
  const size = canvas.code.length;
  for (let i = 0; i < size; i++) [set(canvas, 6, i, i % 2 === 0), set(canvas, i, 6, i % 2 === 0)];
  for (const [x, y] of [[3, 3], [size - 4, 3], [3, size - 4]] as const) square(canvas, x, y, 4, (ring) => ring !== 2 && ring !== 4);
  const span = ALIGNMENT[version - 1] as number;
  const places = span === 0 ? [] : version < 7 ? [6, 6 + span] : [6, 6 + span / 2, 6 + span];
  for (const x of places) {
    for (const y of places) {
      const inTimingLine = (x === 6) !== (y === 6) && x < size - 8 && y < size - 8;
      if (!canvas.fixed[y]?.[x] || inTimingLine) square(canvas, x, y, 2, (ring) => ring !== 1);
    }
  }
}

/** The level of error correction (M is 00) and the mask, twice. */
function drawFormat(canvas: Canvas, maskNumber: number): void {
  const size = canvas.code.length;
  const format = withCheck(maskNumber, 10, 0x537) ^ 0x5412;
  for (let i = 0; i < 15; i++) {
    const dark = ((format >> i) & 1) === 1;
    set(canvas, 8, i < 6 ? i : i < 8 ? i + 1 : size - 15 + i, dark);
    set(canvas, i < 8 ? size - 1 - i : i === 8 ? 7 : 14 - i, 8, dark);
  }
  set(canvas, 8, size - 8, true);
}

/** The version, twice; codes have it from version 7 on. */
function drawVersion(canvas: Canvas, version: number): void {
  const label = withCheck(version, 12, 0x1f25);
  for (let i = 0; i < 18; i++) {
    const [far, near, dark] = [canvas.code.length - 11 + (i % 3), Math.floor(i / 3), ((label >> i) & 1) === 1];
    [set(canvas, far, near, dark), set(canvas, near, far, dark)];
  }
}

/** The data in columns of two modules from the right, upward and downward in turn. */
function drawData({ code, fixed }: Canvas, bits: readonly boolean[], mask: (x: number, y: number) => boolean): void {
  const size = code.length;
  let next = 0;
  for (let right = size - 1; right > 0; right -= right === 8 ? 3 : 2) {
    const upward = ((right + 1) & 2) === 0;
    for (let step = 0; step < size; step++) {
      const y = upward ? size - 1 - step : step;
      for (const x of [right, right - 1]) if (!fixed[y]?.[x]) (code[y] as boolean[])[x] = (bits[next++] ?? false) !== mask(x, y);
    }
  }
}

/** A number followed by the remainder of its division, `length` bits. */
function withCheck(value: number, length: number, divisor: number): number {
  let rest = value;
  for (let i = 0; i < length; i++) rest = (rest << 1) ^ ((rest >> (length - 1)) * divisor);
  return (value << length) | rest;
}

const FINDER = /10111010000|00001011101/g;

/** How hard the code is to read, by the rules of the standard. */
function penalty(code: Grid): number {
  const rows = code.map((row) => row.map(Number).join(""));
  const columns = code.map((_, x) => code.map((row) => Number(row[x])).join(""));
  let found = 0;
  for (const line of [...rows, ...columns]) {
    for (const run of line.match(/0{5,}|1{5,}/g) ?? []) found += run.length - 2;
    for (let i = 0; i + 11 <= line.length; i++) if (line.slice(i, i + 11).match(FINDER)) found += 40;
  }
  rows.forEach((row, y) => {
    for (let x = 0; x + 1 < row.length; x++) if (new Set([row[x], row[x + 1], rows[y + 1]?.[x], rows[y + 1]?.[x + 1]]).size === 1) found += 3;
  });
  const dark = rows.join("").split("1").length - 1;
  return found + 10 * Math.floor(Math.abs(20 * dark - 10 * code.length ** 2) / code.length ** 2);
}
