// Colours of Okabe and Ito (2008), which colour-blind readers can distinguish, each with its own shape and dash.

const LIGHT = ['#0072b2', '#d55e00', '#009e73', '#a8588a', '#b87f00', '#2b8cbe', '#333333', '#8c510a'];
const DARK = ['#56b4e9', '#e8743b', '#1fbf92', '#de9cc2', '#e6b030', '#8fd0f5', '#dddddd', '#d8a35d'];
export const DASHES = ['none', '7 3', '2 2', '9 3 2 3', '5 2 1 2 1 2', '12 3', '1 3', '4 4'];
export const SYMBOLS = ['circle', 'square', 'triangle', 'diamond', 'cross', 'star', 'wye', 'times'] as const;
export const SIGNS = ['\u25cf', '\u25a0', '\u25b2', '\u25c6', '\u271a', '\u2605', '\u2a5a', '\u2715'];

export const isDark = (): boolean => matchMedia('(prefers-color-scheme: dark)').matches;
export const colour = (i: number): string => (isDark() ? DARK : LIGHT)[i % LIGHT.length];
export const symbol = (i: number): (typeof SYMBOLS)[number] => SYMBOLS[i % SYMBOLS.length];
export const ink = (): string => (isDark() ? '#e6e6e6' : '#1d1d1f');
export const faint = (): string => (isDark() ? '#8a8f98' : '#6b7078');
export const paper = (): string => (isDark() ? '#16181c' : '#ffffff');
export const failure = (): string => (isDark() ? '#e8743b' : '#c24e00');
