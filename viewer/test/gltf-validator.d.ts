/** What of Khronos' validator do tests use? It brings no types of its own. */
declare module "gltf-validator" {
  const validator: {
    validateBytes(
      bytes: Uint8Array,
      options: { readonly format: "glb" },
    ): Promise<{ issues: { messages: { severity: number; code: string; pointer?: string }[] } }>;
  };
  export default validator;
}
