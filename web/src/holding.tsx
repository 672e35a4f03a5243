// How contacts and joints hold a posture, in text: forces, the most loaded joints, and the reason if it is not held.
import type { ContactHolding, Dataset, Holding } from './data';
import { colourOfShare, loadedJoints, totalOf } from './forces';
import { number } from './text';

const SHOWN = 6;  // joints

const directionText = (d: number[]) => `(${d.map((v) => (Math.abs(v) < 5e-3 ? 0 : v).toFixed(2)).join(', ')})`;

/** The contact whose movement lets a posture fall: of those that slip or yield, the fastest. */
export function failingContact(holding: Holding | undefined): ContactHolding | null {
  const moving = (holding?.contacts ?? []).filter(({ collapse }) => collapse && ['slips', 'yields'].includes(collapse.movement));
  return moving.reduce<ContactHolding | null>((best, one) => (best === null || (one.collapse!.speed ?? 0) > (best.collapse!.speed ?? 0) ? one : best), null);
}

function movementText({ contact, collapse }: ContactHolding): string {
  switch (collapse!.movement) {
    case 'slips': return `${contact} slips along ${directionText(collapse!.direction!)}`;
    case 'yields': return `${contact} would need more than its largest force: it moves along ${directionText(collapse!.direction!)}`;
    case 'lifts': return `${contact} lifts off`;
    default: return `${contact} rests: the robot tips about it`;
  }
}

function Collapse({ holding, look }: { holding: Holding; look: (p: number[]) => void }) {
  const moving = holding.contacts.filter(({ collapse }) => collapse), failing = failingContact(holding);
  return (
    <>
      <h3>Equilibrium</h3>
      <p class="bad">No forces within friction hold this posture{holding.com_direction && `: its centre of mass falls along ${directionText(holding.com_direction)}`}.</p>
      <ul class="collapse">{moving.map((contact) => (
        <li key={contact.contact} class={contact === failing ? 'bad failing' : ''}><button class="link" onClick={() => look(contact.collapse!.at)}>{movementText(contact)}</button></li>))}</ul>
    </>
  );
}

export function ContactForces({ holding }: { holding: Holding }) {
  return (
    <>
      <h3>Contact forces</h3>
      <table class="lines loads"><thead><tr><th scope="col">Contact</th><th scope="col" title="into the robot, along the surface's normal">normal, N</th><th scope="col" title="along the surface">tangential, N</th><th scope="col" title="tangential force as a share of normal force times friction coefficient">of friction</th></tr></thead>
        <tbody>{holding.contacts.map((contact) => {
          const { normal_N, tangential_N, share } = totalOf(contact);
          return <tr key={contact.contact}><th scope="row">{contact.contact}</th><td>{normal_N.toFixed(0)}</td><td>{tangential_N.toFixed(0)}</td><td>{share === null ? '\u2013' : `${(100 * share).toFixed(0)} %`}</td></tr>;
        })}</tbody></table>
    </>
  );
}

function Torques({ dataset, holding, lookAt }: { dataset: Dataset; holding: Holding; lookAt: (link: number) => void }) {
  const joints = loadedJoints(dataset, holding), unit = (dof: number) => (dataset.robot.joints.find((j) => j.dof === dof)?.type === 'prismatic' ? 'N' : 'N m');
  if (joints.length === 0) return <><h3>Joint torques</h3><p class="none">no joint has an effort limit</p></>;
  const isOverloaded = (dof: number) => holding.overloaded?.includes(dof) ?? false;
  const shown = [...joints.filter(({ dof }) => isOverloaded(dof)), ...joints.filter(({ dof }) => !isOverloaded(dof))].slice(0, Math.max(SHOWN, holding.overloaded?.length ?? 0));
  return (
    <>
      <h3>Most loaded joints</h3>
      <ul class="torques">{shown.map(({ dof, joint, link, torque, limit, share }) => (
        <li key={joint} class={isOverloaded(dof) ? 'bad overloaded' : ''}>
          <button class="link" onClick={() => lookAt(link)}>{joint}</button>{isOverloaded(dof) && <span class="flag">overloaded</span>}
          <span class="load" aria-hidden="true"><span style={{ width: `${Math.min(100, 100 * share)}%`, background: `#${colourOfShare(share).getHexString()}` }} /></span>
          {number(Math.abs(torque))} of {number(limit)} {unit(dof)}, {(100 * share).toFixed(0)} %</li>))}</ul>
    </>
  );
}

export function HoldingList({ dataset, holding, look, lookAt }: { dataset: Dataset; holding: Holding; look: (p: number[]) => void; lookAt: (link: number) => void }) {
  if (!holding.balanced) return <Collapse holding={holding} look={look} />;
  return <><ContactForces holding={holding} /><Torques dataset={dataset} holding={holding} lookAt={lookAt} /></>;
}

/** Scale of the arrows for the present zoom, and colours. `most`: largest length of its arrow, pixels. */
export function ForceLegend({ pixelsPerNewton, most }: { pixelsPerNewton: number; most: number }) {
  const largest = most / pixelsPerNewton, decade = 10 ** Math.floor(Math.log10(largest));
  const newtons = [5, 2, 1].map((step) => step * decade).find((step) => step <= largest) ?? decade, pixels = newtons * pixelsPerNewton;
  return (
    <div class="force-legend">
      <span><svg width={pixels} height="10" aria-hidden="true"><path d={`M0 5H${pixels - 8}M${pixels - 8} 1L${pixels} 5L${pixels - 8} 9Z`} stroke="currentColor" fill="currentColor" stroke-width="2" /></svg> {newtons} N</span>
      <span><i class="load-ramp" /> torque, 0 to its limit</span>
    </div>
  );
}
