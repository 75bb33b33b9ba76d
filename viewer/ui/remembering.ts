/** What does a page remember? A few words, on this device or in this tab. Pages may be forbidden to keep anything. */

/** Until somebody clears it, or until the tab is closed: then it holds over reloads and other scenes. */
export type Where = "device" | "tab";

// To ask a page that may keep nothing for where it would is an error, too.
const storage = (where: Where): Storage => (where === "tab" ? sessionStorage : localStorage);

export function remember(where: Where, name: string, value: string): void {
  try {
    storage(where).setItem(name, value);
  } catch {}
}

export function recall(where: Where, name: string): string | null {
  try {
    return storage(where).getItem(name);
  } catch {
    return null;
  }
}
