/**
 * Will a loop place more than may be? Where each of its turns places something for sure, that is known before the first, and need not be
 * found out at the end of a million. As `crates/scene/src/procedural/evaluator/foreseen.rs`.
 */
import type { Program } from "../link.ts";
import type { At, Statement } from "../syntax.ts";

/** Loops of fewer turns are soon done. */
const MANY = 1000;

/** Where so many turns of a statement would place the first thing that is beyond what is `left`; nothing where it is not known. */
export function foreseen(
  program: Program,
  module: number,
  turns: number,
  body: Statement,
  left: number,
): At | undefined {
  if (turns < MANY) return undefined;
  const places = placedForSure(program, module, body);
  const room = Math.max(0, left);
  return turns * places.length > room ? places[room % places.length] : undefined;
}

/** Where a statement places something, whatever is chosen in it; not what rules and loops in it place. */
function placedForSure(program: Program, module: number, statement: Statement): At[] {
  const inside = (inner: Statement) => placedForSure(program, module, inner);
  switch (statement.kind) {
    case "group":
      return statement.of.flatMap(inside);
    case "place":
    case "paint":
      return inside(statement.body);
    case "if": {
      if (!statement.no) return [];
      const [yes, no] = [inside(statement.yes), inside(statement.no)];
      return no.length < yes.length ? no : yes;
    }
    case "called":
    case "viewpoint":
    case "model":
      return [statement.at];
    case "call": {
      const call = program.modules[module]?.calls[statement.call];
      const rule = call && program.modules[call.module]?.rules[call.index];
      return call && (call.index < 0 || rule?.isPart) ? [call.at] : [];
    }
    default:
      return [];
  }
}
