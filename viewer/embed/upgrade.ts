/**
 * What becomes of what a page sets on an element before the element's class is known? It stands on the element itself and
 * hides the property of the class, which would never hear of it: so it is taken away there and set once more.
 */
export function takeEarly<Name extends string>(element: { [Key in Name]: unknown }, ...names: Name[]): void {
  for (const name of names) {
    if (!Object.hasOwn(element, name)) continue;
    const value = element[name];
    Reflect.deleteProperty(element, name);
    element[name] = value;
  }
}
