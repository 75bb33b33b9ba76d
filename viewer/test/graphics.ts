/**
 * What does a graphics card learn, and when? One for tests that draws nothing, so that three.js runs as in a page, and counts the programs
 * that it is given.
 */
const CONSTANT = /^[A-Z][A-Z0-9_]+$/;
const [COMPLETION_STATUS_KHR, UNMASKED_RENDERER_WEBGL] = [0x91b1, 0x9246];
const EXTENSIONS: Readonly<Record<string, object>> = {
  KHR_parallel_shader_compile: { COMPLETION_STATUS_KHR },
  WEBGL_debug_renderer_info: { UNMASKED_RENDERER_WEBGL },
  EXT_color_buffer_float: {},
};

export class GraphicsCard {
  /** Programs that it was ever given. */
  programs = 0;
  readonly canvas: HTMLCanvasElement;
  private readonly numbers = new Map<string, number>();
  private readonly listeners = new Map<string, ((event: object) => void)[]>();

  constructor(name = "a graphics card") {
    const context = this.contextOf(name);
    const [width, height] = [160, 90];
    this.canvas = {
      width,
      height,
      clientWidth: width,
      clientHeight: height,
      style: {},
      addEventListener: (kind: string, listener: (event: object) => void) =>
        this.listeners.set(kind, [...(this.listeners.get(kind) ?? []), listener]),
      removeEventListener: () => {},
      getContext: (kind: string) => (kind === "webgl2" ? context : null),
    } as unknown as HTMLCanvasElement;
  }

  /** Has the page lose what it gave the card, and find that out. */
  tell(event: "webglcontextlost" | "webglcontextrestored"): void {
    for (const listener of this.listeners.get(event) ?? []) listener({ preventDefault: () => {} });
  }

  private contextOf(name: string): object {
    const known: Readonly<Record<string, unknown>> = {
      getContextAttributes: () => ({}),
      getExtension: (extension: string) => EXTENSIONS[extension] ?? null,
      getParameter: (number: number) => this.parameter(number, name),
      getProgramParameter: (_program: object, number: number) =>
        number === COMPLETION_STATUS_KHR || number === this.numbers.get("LINK_STATUS") ? true : 0,
      getShaderPrecisionFormat: () => ({ rangeMin: 127, rangeMax: 127, precision: 23 }),
      getSupportedExtensions: () => [],
      getSyncParameter: () => this.numberOf("SIGNALED"),
      isContextLost: () => false,
      checkFramebufferStatus: () => this.numbers.get("FRAMEBUFFER_COMPLETE"),
      linkProgram: () => {
        this.programs += 1;
      },
    };
    return new Proxy(known, {
      get: (target, key) => {
        if (typeof key === "symbol" || key in target) return target[key as string];
        if (CONSTANT.test(key)) return this.numberOf(key);
        return key.startsWith("create") ? () => ({}) : () => null;
      },
    });
  }

  private numberOf(constant: string): number {
    const number = this.numbers.get(constant) ?? 1000 + this.numbers.size;
    this.numbers.set(constant, number);
    return number;
  }

  private parameter(number: number, name: string): unknown {
    if (number === UNMASKED_RENDERER_WEBGL) return name;
    const [constant = ""] = [...this.numbers].find(([, known]) => known === number) ?? [];
    if (/BOX|VIEWPORT/.test(constant)) return [0, 0, 1, 1];
    return /VERSION/.test(constant) ? "WebGL 2.0" : 16;
  }
}
