/** How deep may a device go? */
import { DcgError } from "./error.ts";

/**
 * Does something with rules. The language bounds how deep they may go, but not every device has a stack of that size: there it
 * is refused as what goes too deep.
 */
export function withinStack<T>(file: string, does: () => T): T {
  try {
    return does();
  } catch (error) {
    // As V8 and JavaScriptCore say it, and SpiderMonkey.
    if (error instanceof Error && /call stack|too much recursion/.test(error.message)) {
      throw DcgError.ofWhole(file, TOO_DEEP);
    }
    throw error;
  }
}

const TOO_DEEP = "its rules go deeper into one another than this device can follow; nest and call less deep";
