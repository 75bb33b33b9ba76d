/** What does a surface look like? Equal calls give the same material. As `crates/scene/src/procedural/evaluator/material.rs`. */
import { linearLight } from "../arithmetic.ts";
import { type Channels, PLAIN, type Surface } from "../grown.ts";
import { Known } from "../known.ts";
import { reached } from "../limits.ts";
import type { Scope } from "../plain/machine.ts";
import { stepName } from "../random.ts";
import type { Call, MaterialRule, Written } from "../syntax.ts";
import { isNumbers, sizesOf, type Value } from "../value.ts";
import { Modules } from "./modules.ts";

/** What tells a material apart besides its arguments: file, rule and instance. */
const KEY_NUMBERS = 3;

export abstract class Materials extends Modules {
  private readonly knownMaterials = new Known();

  /** The index of the material that a call leads to. */
  protected surface(scope: Scope, index: number): number {
    const call = this.called(scope, index);
    const rule = this.module(call.module).materials[call.index] as MaterialRule;
    const inner = this.bound(scope, call, rule, scope.depth, stepName(this.seed, rule.name));
    const { stack } = this;
    let known = this.knownMaterials.at(call.module).at(call.index).at(inner.instance);
    for (let i = 0; i < rule.slots; i += 1) {
      const value = stack.get(inner.base + i);
      // A number is compared at one go.
      if (typeof value !== "number") this.countLists(scope, call.at, [value]);
      known = known.of(value);
    }
    if (known.index === undefined) {
      const args = stack.slice(inner.base, rule.slots);
      const limit = this.limits.materials;
      if (this.materials.length >= limit) throw this.error(scope.module, call.at, reached("materials", limit));
      this.keep(scope.module, call.at, KEY_NUMBERS + sizesOf(args));
      const surface = this.traced(scope.module, call.at, () => this.computedSurface(inner, rule));
      known.index = this.materials.push(surface) - 1;
    }
    this.stack.close(inner.base);
    return known.index;
  }

  /** The same of a material without arguments, of the same file, when it has been computed before. */
  protected knownSurface({ module, instance }: Scope, index: number): number | undefined {
    const { index: rule } = this.module(module).calls[index] as Call;
    return this.knownMaterials.at(module).at(rule).at(instance).index;
  }

  private computedSurface(scope: Scope, rule: MaterialRule): Surface {
    const surface = { ...PLAIN, name: rule.name };
    for (const [property, value] of rule.properties) {
      if (property === "colour" || property === "emissive") {
        surface[property] = this.colour(scope, value);
        continue;
      }
      const share = this.ranged(scope, value, property, 0, 1);
      if (property === "double_sided") surface.doubleSided = share !== 0;
      else if (property === "recolour") surface.recolour = share !== 0;
      else surface[property] = share;
    }
    return surface;
  }

  /** Linear light of a colour. */
  private colour(scope: Scope, { at, of }: Written): Channels {
    const value = this.value(scope, at, of);
    const channels = typeof value === "number" ? [] : value.items;
    const isShare = (channel: Value) => typeof channel === "number" && channel >= 0 && channel <= 1;
    if (channels.length !== 3 || !channels.every(isShare)) {
      const [what, wanted] = ["a colour", "`#rrggbb`, or three numbers from 0 to 1"] as const;
      throw isNumbers(value, 3)
        ? this.amount(scope.module, at, what, wanted)
        : this.unfit(scope.module, at, what, wanted);
    }
    return (channels as number[]).map(linearLight) as unknown as Channels;
  }
}
