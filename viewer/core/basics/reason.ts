/** Why did something fail, in words? Anything may be thrown, and most of it is an error that says so. */
export function reasonOf(thrown: unknown): string {
  return thrown instanceof Error ? thrown.message : String(thrown);
}
