/** Do two links lead into the same world, though perhaps to other places in it? */
export function isSameWorld(one: string | null, other: string | null, base: string): boolean {
  const world = worldOf(one, base);
  return world !== undefined && world === worldOf(other, base);
}

/** A link without the place; nothing where it is none. */
function worldOf(link: string | null, base: string): string | undefined {
  if (link === null || !URL.canParse(link, base)) return undefined;
  const url = new URL(link, base);
  url.hash = "";
  return url.href;
}
