declare module '*.css' {
  const text: string;
  export default text;
}
// The text of a program for a thread; build.mjs bundles it.
declare module 'program:*' { const text: string; export default text; }
