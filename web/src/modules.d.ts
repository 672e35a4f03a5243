declare module '*.css' {
  const text: string;
  export default text;
}
// The text of a program for a thread; build.mjs bundles it.
declare module 'program:*' { const text: string; export default text; }
declare module '*.sql' { const text: string; export default text; }
declare module 'sql.js/dist/sql-wasm-inline.js' {
  import initSqlJs from 'sql.js';
  export default initSqlJs;
  export type { Database } from 'sql.js';
}
