/** Which link is an element to show? What is none is told by what its author wrote. */

const SUCH = 'such as src="https://host/?scene=museum"';
/** So much of it is said back. */
const SAID_CHARACTERS = 80;

/** What stands in `src`, or the lack of it. */
export class SrcError extends Error {
  override readonly name = "SrcError";

  constructor(
    readonly title: string,
    readonly text: string,
  ) {
    super(`${title}. ${text}`);
  }
}

/** The link in an element's `src`, in a page at `base`. */
export function readSrc(src: string | null, base: string): URL {
  if (!src?.trim()) {
    throw new SrcError("“src” is missing", `Give this <belvedere-scene> a link to a viewer, ${SUCH}.`);
  }
  const link = URL.canParse(src, base) ? new URL(src, base) : undefined;
  if (link?.protocol === "http:" || link?.protocol === "https:") return link;
  const said = src.length > SAID_CHARACTERS ? `${src.slice(0, SAID_CHARACTERS)}…` : src;
  // What is well in itself leads astray from a page that has no web address.
  const from = link && !URL.canParse(src) ? ` from ${base}` : "";
  throw new SrcError(
    `“src=${said}” is not a web address${from}`,
    `Give this <belvedere-scene> a link to a viewer, which begins with http:// or https://, ${SUCH}.`,
  );
}
