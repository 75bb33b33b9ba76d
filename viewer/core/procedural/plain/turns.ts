/** What do several turns compute? The numbers of a plan, side by side, from what is given to each turn and to all of them. */
import type { Globals, Stack } from "../stack.ts";
import * as code from "./code.ts";
import { fill, WIDTH } from "./columns.ts";
import type { Machine, Scope } from "./machine.ts";
import type { Plan, Prelude } from "./plan.ts";

export class Turns {
  /** The path of each. */
  readonly paths = new Int32Array(WIDTH);

  constructor(
    private readonly machine: Machine,
    private readonly detail: number,
  ) {}

  /** Whether all is computed that is the same in all turns, so many of them at most. */
  prepare(plan: Plan, scope: Scope, stack: Stack, file: Globals, most: number): boolean {
    const { columns, globals, locals } = plan;
    if (plan.file !== file) {
      for (let i = 0; i < globals.length; i += 2) {
        columns[(globals[i + 1] as number) * WIDTH] = file.numbers[globals[i] as number] as number;
      }
      columns[code.DETAIL * WIDTH] = this.detail;
      plan.isSound = this.computes(plan.once, columns, WIDTH, scope, stack, file);
      plan.materials = undefined;
      plan.file = file;
    }
    if (!plan.isSound) return false;
    for (let i = 0; i < locals.length; i += 2) {
      columns[(locals[i + 1] as number) * WIDTH] = stack.numbers[scope.base + (locals[i] as number)] as number;
    }
    columns[code.LEVEL * WIDTH] = scope.level;
    return this.computes(plan.forAll, columns, Math.min(most, WIDTH), scope, stack, file);
  }

  private computes(
    { words, spread }: Prelude,
    columns: Float64Array,
    most: number,
    scope: Scope,
    stack: Stack,
    file: Globals,
  ): boolean {
    if (!code.isEmpty(words) && !this.machine.compute(words, columns, WIDTH, 1, this.paths, scope, stack, file)) {
      return false;
    }
    for (let i = 0; i < spread.length; i += 1) {
      const at = (spread[i] as number) * WIDTH;
      fill(columns, at, columns[at] as number, most);
    }
    return true;
  }

  /** Whether so many turns are computed. */
  run(plan: Plan, scope: Scope, stack: Stack, file: Globals, count: number): boolean {
    this.machine.skip(plan, count);
    return this.machine.compute(plan.words, plan.columns, WIDTH, count, this.paths, scope, stack, file);
  }
}
