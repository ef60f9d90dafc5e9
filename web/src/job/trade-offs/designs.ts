/** Designs of a Pareto front: names, axes and drawing. */

import type { Front, ScenarioResult } from '../../api/types'
import type { Cloud, Mark } from '../../charts/scatter/scatter'
import { placeWord } from '../../format/place'
import { columnNamed, type Particles } from '../designs/particles'
import type { Reference } from '../reference'

/** Default axes: less vibration costs speed. */
const USUAL = ['reciprocal_speed', 'acceleration']

export function ownerWords(owner: string): string {
  return owner === 'job' ? 'the job’s preference' : owner
}

/** The two objectives to draw: the requested ones, or the default trade-off. */
export function axesOf(front: Front, x: string | null, y: string | null): [string, string] {
  const names = front.objectives.map(({ name }) => name)
  const candidates = [x, y, ...USUAL, ...names].filter(
    (name) => name !== null && names.includes(name),
  )
  const [first, second] = new Set(candidates)
  return [first!, second!]
}

/** All designs in two objectives, including the front. */
export function allCloud(particles: Particles, x: string, y: string): Cloud | null {
  const values = (name: string) => columnNamed(particles, `objective:${name}`)?.values
  const [xs, ys] = [values(x), values(y)]
  if (!xs || !ys) return null
  return { x: xs, y: ys, colour: '--series-6', radius: 2, opacity: 0.35 }
}

/** Selected designs as rings. rows: of `particles`. */
export function selectedCloud(
  particles: Particles,
  rows: Uint32Array,
  x: string,
  y: string,
): Cloud | null {
  const all = allCloud(particles, x, y)
  if (!all) return null
  const of = (values: Cloud['x']) => Array.from(rows, (row) => values[row])
  return { x: of(all.x), y: of(all.y), colour: '--text', radius: 5.5, opacity: 1 }
}

/** The front in two objectives, in the order of `designs`. */
export function frontCloud({ designs }: Front, x: string, y: string): Cloud {
  return {
    x: designs.map(({ objectives }) => objectives[x]),
    y: designs.map(({ objectives }) => objectives[y]),
    colour: '--series-1',
    radius: 3.5,
    opacity: 0.9,
  }
}

export interface PublishedDesign {
  readonly label: string
  readonly objectives: Readonly<Record<string, number>>
}

export function publishedDesign(front: Front, reference: Reference): PublishedDesign | null {
  const walks = Object.values(reference.scenarios)
  if (walks.some(({ status }) => status !== 'ok')) return null
  const objectives = front.objectives.map(({ name }) => [name, geometricMean(walks, name)] as const)
  return { label: reference.label, objectives: Object.fromEntries(objectives) }
}

function geometricMean(walks: readonly ScenarioResult[], objective: string): number {
  const logarithms = walks.map(({ objectives }) => Math.log(objectives[objective] ?? Number.NaN))
  return Math.exp(logarithms.reduce((a, b) => a + b, 0) / walks.length)
}

export function publishedMarks(
  designs: readonly PublishedDesign[],
  x: string,
  y: string,
): readonly Mark[] {
  return designs.map(({ label, objectives }) => ({
    x: objectives[x],
    y: objectives[y],
    name: label,
    colour: '--series-4',
    shape: 'square',
  }))
}

/** Knees, and the best designs under A, B, C and the job's preference; one mark per design. */
export function marksOf(front: Front, x: string, y: string): readonly Mark[] {
  const winners = new Map<string, Mark>()
  for (const winner of front.winners) {
    const word = placeWord(winner)
    const name = winner.preference
    const before = winners.get(word)
    winners.set(word, {
      x: winner.objectives[x],
      y: winner.objectives[y],
      name: before ? `${before.name}, ${name}` : name,
      colour: '--series-5',
      shape: 'ring',
    })
  }
  const knees = front.knees.map(
    (knee, index): Mark => ({
      x: knee.objectives[x],
      y: knee.objectives[y],
      name: `knee ${index + 1}`,
      colour: '--series-2',
      shape: 'diamond',
    }),
  )
  return [...winners.values(), ...knees]
}
