/** Where does a call lead? Along an edge of the graph. As `crates/scene/src/procedural/evaluator/call.rs`. */
import type { Scope } from "../plain/machine.ts";
import { step } from "../random.ts";
import type { Call, Rule } from "../syntax.ts";
import { Parts } from "./parts.ts";
import type { Turtle } from "./state.ts";

export abstract class Calls extends Parts {
  /** Visits what a call leads to: rules draw into the part they are called in, parts and files are parts of their own. */
  protected follow(scope: Scope, turtle: Turtle, index: number): void {
    const call = this.called(scope, index);
    const depth = this.deeper(scope, call.at);
    if (call.index < 0) {
      this.placeFile(scope, turtle, call, depth);
      return;
    }
    const rule = this.module(call.module).rules[call.index] as Rule;
    this.enterRule(scope, turtle, call, rule, this.bound(scope, call, rule, depth, step(scope.path, call.site)));
  }

  /** The same for a rule or part of this file, whose arguments are computed: from a place of the stack on. */
  protected followGiven(scope: Scope, turtle: Turtle, index: number, first: number): void {
    const call = this.called(scope, index);
    const depth = this.deeper(scope, call.at);
    const rule = this.module(call.module).rules[call.index] as Rule;
    this.enterRule(scope, turtle, call, rule, this.boundTo(scope, call, rule, depth, first));
  }

  private enterRule(scope: Scope, turtle: Turtle, call: Call, rule: Rule, inner: Scope): void {
    try {
      if (rule.isPart) this.placePart(scope, call, turtle, rule, inner);
      else this.visitRule(turtle, rule, call.index, inner);
    } catch (error) {
      throw this.addCaller(scope.module, call.at, error);
    }
    this.stack.close(inner.base);
  }
}
