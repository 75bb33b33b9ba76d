/**
 * Can meshes be decoded here? Their decoder is WebAssembly, which a page's Content Security Policy keeps from running
 * unless it says otherwise, and which some browsers do not have.
 */
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";

// It starts by itself; who wants to know whether it could asks below.
MeshoptDecoder.ready?.catch(() => {});

/** Nothing can be shown, since no mesh can be decoded. */
export class NoDecoderError extends Error {
  override readonly name = "NoDecoderError";

  /** Whether the page forbids it; else the browser cannot do it. */
  constructor(
    readonly isForbidden: boolean,
    cause: unknown,
  ) {
    super("WebAssembly cannot run here", { cause });
  }
}

/** Waits until meshes can be decoded; fails with a {@link NoDecoderError} where they cannot. */
export async function decoderReady({ supported, ready } = MeshoptDecoder): Promise<void> {
  if (!supported) throw new NoDecoderError(false, undefined);
  try {
    await ready;
  } catch (cause) {
    // The decoder comes with the viewer and is sound, so what does not let it run is the page.
    throw new NoDecoderError(true, cause);
  }
}
