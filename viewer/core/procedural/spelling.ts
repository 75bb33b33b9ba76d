/** Which known name was meant? */

/** What other languages call something, and what it is called here. */
const ELSEWHERE = new Map([
  ["cube", "box"],
  ["cuboid", "box"],
  ["ball", "sphere"],
  ["plane", "polygon"],
  ["extrude", "prism"],
  ["translate", "move"],
  ["rotate", "turn"],
  ["repeat", "for"],
  ["while", "for"],
  ["switch", "choose"],
  ["pow", "power"],
  ["lerp", "mix"],
  ["len", "count"],
  ["length", "count"],
  ["color", "paint"],
  ["colour", "paint"],
]);

/**
 * The known name that is most like this one, when one is like it: of the letters of the longer one at most a third differ, or
 * one, or all by their case only; or the one that means what this means elsewhere. Never the very same.
 */
export function nearest(name: string, known: readonly string[]): string | undefined {
  const here = ELSEWHERE.get(name);
  if (here !== undefined && known.includes(here)) return here;
  const letters = [...name].length;
  let least = Infinity;
  let best: string | undefined;
  for (const candidate of known) {
    if (candidate === name) continue;
    const found = lower(candidate) === lower(name) ? 0 : distance(name, candidate);
    const most = Math.max(1, Math.floor(Math.max(letters, [...candidate].length) / 3));
    if (found > most || found > least || (found === least && best !== undefined && candidate >= best)) continue;
    least = found;
    best = candidate;
  }
  return best;
}

/** In small letters, those of ASCII only. */
function lower(name: string): string {
  return name.replace(/[A-Z]/g, (letter) => letter.toLowerCase());
}

/** Letters to insert, delete, replace or swap with the next (optimal string alignment). */
function distance(first: string, second: string): number {
  const a = [...first];
  const b = [...second];
  const rows: number[][] = [Array.from({ length: b.length + 1 }, (_, j) => j)];
  const cell = (i: number, j: number) => rows[i]?.[j] ?? 0;
  for (let i = 1; i <= a.length; i += 1) {
    const row = [i];
    rows.push(row);
    for (let j = 1; j <= b.length; j += 1) {
      const differs = a[i - 1] === b[j - 1] ? 0 : 1;
      let least = Math.min(cell(i - 1, j) + 1, cell(i, j - 1) + 1, cell(i - 1, j - 1) + differs);
      if (i > 1 && j > 1 && a[i - 1] === b[j - 2] && a[i - 2] === b[j - 1]) {
        least = Math.min(least, cell(i - 2, j - 2) + 1);
      }
      row[j] = least;
    }
  }
  return cell(a.length, b.length);
}
