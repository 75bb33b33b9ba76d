/** Where do statements before a statement move it? */
import type { Scope } from "../plain/machine.ts";
import { FARTHEST, LEAST_SCALE, MOVE } from "../ranges.ts";
import type { At, Row, Statement, Transform } from "../syntax.ts";
import { Enumerators } from "./enumerators.ts";
import type { Turtle } from "./state.ts";

type Kind<K extends Statement["kind"]> = Extract<Statement, { kind: K }>;

export abstract class Places extends Enumerators {
  protected placed(scope: Scope, turtle: Turtle, { at, transform, by }: Kind<"place">): Turtle {
    const isOne = by.of.length === 1;
    this.rangedRow(scope, by, MOVE);
    const x = this.taken(0);
    const y = isOne ? x : this.taken(1);
    const z = isOne ? x : this.taken(2);
    const placed = this.transformed(scope, by, turtle, transform, x, y, z);
    // Numbers are still told apart so far out.
    if (this.turtles.isWithin(placed, FARTHEST)) return placed;
    const wanted = "within 1000000000 m, and no more times as large";
    throw this.error(scope.module, at, `the place to which this leads must be ${wanted}`);
  }

  private transformed(
    scope: Scope,
    { places }: Row,
    turtle: Turtle,
    transform: Transform,
    x: number,
    y: number,
    z: number,
  ): Turtle {
    switch (transform) {
      case "move":
        return this.turtles.moved(turtle, x, y, z);
      case "turn":
        return this.turtles.turned(turtle, "y", x);
      case "tilt":
        return this.turtles.turned(turtle, "x", x);
      case "roll":
        return this.turtles.turned(turtle, "z", x);
      case "scale": {
        if (Math.min(Math.abs(x), Math.abs(y), Math.abs(z)) >= LEAST_SCALE) return this.turtles.scaled(turtle, x, y, z);
        const least = [x, y, z].findIndex((factor) => Math.abs(factor) < LEAST_SCALE);
        throw this.error(scope.module, places[least] as At, "a scale must be 0.000001 or more, or as much below 0");
      }
    }
  }
}
