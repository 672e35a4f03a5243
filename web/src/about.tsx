// Origin of the figures, and the differences between two methods.
import type { Experiment, Page } from './data';
import { go, type State } from './state';
import { DASH } from './text';

function flat(value: unknown, prefix = '', into: Map<string, string> = new Map()): Map<string, string> {
  if (value !== null && typeof value === 'object' && !Array.isArray(value)) {
    for (const [key, inner] of Object.entries(value)) flat(inner, prefix ? `${prefix}.${key}` : key, into);
  } else {
    into.set(prefix, JSON.stringify(value));
  }
  return into;
}

function Options({ experiment, state }: { experiment: Experiment; state: State }) {
  const a = Number(state.a ?? 0), b = Number(state.b ?? Math.min(1, experiment.methods.length - 1));
  const left = flat(experiment.methods[a]?.options), right = flat(experiment.methods[b]?.options);
  const all = state.all !== undefined;
  const keys = [...new Set([...left.keys(), ...right.keys()])].filter((key) => all || left.get(key) !== right.get(key));
  const select = (key: string, value: number) => (
    <select aria-label={key} value={value} onChange={(x) => go({ [key]: x.currentTarget.value })}>
      {experiment.methods.map((method, m) => <option value={m} key={m}>{method.choice}</option>)}</select>);
  return (
    <>
      <h3>Options of two methods</h3>
      <div class="bar">{select('a', a)} {select('b', b)} <label><input type="checkbox" checked={all} onChange={() => go({ all: all ? undefined : '1' })} /> equal rows</label></div>
      <div class="scroll"><table class="lines"><thead><tr><th scope="col">Option</th><th scope="col">{experiment.methods[a]?.choice}</th><th scope="col">{experiment.methods[b]?.choice}</th></tr></thead>
        <tbody>{keys.map((key) => <tr key={key}><th scope="row">{key}</th><td>{left.get(key) ?? DASH}</td><td>{right.get(key) ?? DASH}</td></tr>)}
          {keys.length === 0 && <tr><td colSpan={3}>no difference</td></tr>}</tbody></table></div>
    </>
  );
}

export function AboutView({ page, experiment, state }: { page: Page; experiment: Experiment; state: State }) {
  const facts: [string, string][] = [
    ['experiment', `${experiment.id} '${experiment.name}'${experiment.place && ` of ${experiment.place}`}`], ['state', `${experiment.state}${experiment.unfinished > 0 ? `, ${experiment.unfinished} jobs unfinished` : ''}`],
    ['submitted', `${experiment.submitted_utc} UTC`], ['dataset', `${experiment.dataset.name}, problems: ${experiment.dataset.split}`], ['hash', experiment.dataset.hash],
    ['rule', `${experiment.rule}: whose verdict counts as solved (docs/explanation/paper.md)`], ['seed', String(experiment.seed)], ['repetitions', String(experiment.repetitions)],
    ['results by', experiment.origin || 'unknown'], ['newest result', experiment.newest_result_utc ? `${experiment.newest_result_utc} UTC` : DASH], ['page by', `legopt ${page.legopt.version}, build ${page.legopt.build_id}; format ${page.format}`],
  ];
  return (
    <>
      <table class="lines"><tbody>{facts.map(([name, value]) => <tr key={name}><th scope="row">{name}</th><td>{value}</td></tr>)}</tbody></table>
      <h3>Builds and machines</h3>
      <div class="scroll"><table class="lines"><thead><tr>{['build', 'host', 'processor', 'processors', 'load', 'workers', 'results'].map((h) => <th scope="col" key={h}>{h}</th>)}</tr></thead>
        <tbody>{experiment.table.origins.map((o, i) => <tr key={i}>{['build', 'hostname', 'processor', 'processors', 'load', 'workers', 'results'].map((k) => <td key={k}>{String(o[k] ?? DASH)}</td>)}</tr>)}</tbody></table></div>
      <h3>Methods</h3>
      <div class="scroll"><table class="lines"><thead><tr><th scope="col">method</th><th scope="col">as commands name it</th><th scope="col">obstacles</th><th scope="col">hash of all options</th></tr></thead>
        <tbody>{experiment.methods.map((m) => <tr key={m.id}><td>{m.title}</td><td>{m.choice}</td><td>{m.collision}</td><td><code>{m.hash.slice(0, 16)}</code></td></tr>)}</tbody></table></div>
      <Options experiment={experiment} state={state} />
      <h3>How to read the figures</h3>
      <p>The unit of every figure is the problem; repetitions of one are averaged first. Failed jobs count, missing ones do not. Each figure is defined in docs/explanation/statistics.md, and docs/how-to/page.md says what to conclude from it, and what not.</p>
    </>
  );
}
