/** How is a published model grown instead of being downloaded? `docs/FORMAT.md`, "Objects": its rules and parameters. */
import { grow, type Settings } from "./evaluator/index.ts";
import type { Surface } from "./grown.ts";
import { type Program, readProgram, withFirst } from "./link.ts";
import type { Mesh } from "./solid/mesh.ts";
import type { JsonValue } from "./value.ts";

/** What an object info says of rules, with their texts in place of their addresses. */
export interface Recipe {
  /** The text of the rules. */
  readonly rules: string;
  /** The texts of what they import, by the names that they give it. */
  readonly imports: ReadonlyMap<string, string>;
  /** The part of them; `undefined` for the file as a whole. */
  readonly part: string | undefined;
  readonly parameters: Readonly<Record<string, JsonValue>>;
}

/** Triangles in the model's own space, and the materials that they name. */
export interface GrownModel {
  readonly meshes: readonly Mesh[];
  readonly materials: readonly Surface[];
}

/** The name under which the rules are imported; none of theirs can be called so: no file beside a source has a colon in its name. */
const RULES = ":";
const IMPORT = `import "${RULES}" as rules`;

/** Rules that were read once, for many models. */
export class Rulebook {
  private readonly program: Program;

  /** Reads rules and what they import. Throws a `DcgError`. */
  constructor({ rules, imports }: Pick<Recipe, "rules" | "imports">) {
    const load = (path: string): string => {
      const text = path === RULES ? rules : imports.get(path);
      if (text === undefined) throw new Error("it is not among the imports");
      return text;
    };
    this.program = readProgram("model", IMPORT, load);
  }

  /** Grows one model. Throws a `DcgError`. */
  grow(
    { part, parameters }: Omit<Recipe, "rules" | "imports">,
    settings: Omit<Settings, "parameters"> = {},
  ): GrownModel {
    const args = Object.entries(parameters).map(([name, value]) => `${name} = ${JSON.stringify(value)}`);
    const callee = part === undefined ? "rules" : `rules.${part}`;
    const program = withFirst(this.program, "model", `${IMPORT} ${callee}(${args.join(", ")})`);
    const grown = grow(program, settings);
    return { meshes: grown.parts[1]?.meshes ?? [], materials: grown.materials };
  }
}

/** Grows one model. Throws a `DcgError`. */
export function growModel(recipe: Recipe, settings: Omit<Settings, "parameters"> = {}): GrownModel {
  return new Rulebook(recipe).grow(recipe, settings);
}
