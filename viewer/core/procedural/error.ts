/** What is wrong with a procedural model, where, and what would put it right? The same sentences as in Rust. */

/** Longest part of a line that an error repeats, characters. */
const MOST_SHOWN = 120;

/** Something wrong at a place of a text that is not told yet: the parser knows one file only. */
export class Fault extends Error {
  constructor(
    /** Index in the text. */
    readonly at: number,
    readonly problem: string,
  ) {
    super(problem);
  }
}

/** Why a model was refused. Line and column count from 1, columns in characters. */
export class DcgError extends Error {
  override readonly name = "DcgError";

  private constructor(
    readonly file: string,
    readonly line: number,
    readonly column: number,
    /** The line, without the spaces around it. */
    readonly text: string,
    readonly problem: string,
  ) {
    super(`${file}, line ${line}, column ${column}: ${problem}${text ? `\n    ${text}` : ""}`);
  }

  static at(file: string, source: string, at: number, problem: string): DcgError {
    const before = source.slice(0, at);
    const start = Math.max(before.lastIndexOf("\n"), before.lastIndexOf("\r")) + 1;
    const line = /^[^\r\n]*/.exec(source.slice(start))?.[0] ?? "";
    const shown = [...line.trim()].slice(0, MOST_SHOWN).join("");
    const column = [...before.slice(start)].length + 1;
    return new DcgError(file, lineOf(source, at), column, shown, problem);
  }
}

/** The line in which a place lies, counted from 1. Lines end as on any machine, old ones too. */
export function lineOf(text: string, at: number): number {
  return text.slice(0, at).split(/\r\n|\r|\n/).length;
}

export function unknown(kind: string, name: string, known: Iterable<string>): string {
  const suggestion = nearest(name, known);
  return `\`${name}\` is not a ${kind} here${suggestion === undefined ? "" : `; did you mean \`${suggestion}\`?`}`;
}

export function expected(what: string, found: string): string {
  return `expected ${what}, found ${found}`;
}

export function reserved(name: string): string {
  return `\`${name}\` is a word of the language; choose another name`;
}

export function twice(name: string, firstLine: number): string {
  return `\`${name}\` was already given on line ${firstLine}; rename one of the two`;
}

export function tooManyArguments(callee: string, most: number): string {
  return `\`${callee}\` takes ${most} arguments; remove this one`;
}

export function missingArgument(callee: string, name: string): string {
  return `\`${callee}\` needs \`${name}\`; give it, or a default where \`${callee}\` is defined`;
}

export function argumentTwice(name: string): string {
  return `\`${name}\` is given twice; remove one of the two`;
}

export function outOfRange(what: string, value: number, min: number, max: number): string {
  return `${what} is ${shown(value)}; it must be from ${shown(min)} to ${shown(max)}`;
}

/** A number as Rust writes it. */
export function shown(number: number): string {
  return `${number}`.replace("e+", "e");
}

export const DIVISION_BY_ZERO = "division by zero; test the divisor with `if` before";
export const POLYGON = "this polygon crosses itself or has no area; list its corners in order around it";

/** The known name that is most like this one, when one is like it: at most a third of its letters differ. */
export function nearest(name: string, known: Iterable<string>): string | undefined {
  let least = Math.ceil([...name].length / 3);
  let best: string | undefined;
  for (const candidate of known) {
    const found = distance(name, candidate);
    if (found > least || (found === least && best !== undefined && candidate >= best)) continue;
    least = found;
    best = candidate;
  }
  return best;
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
