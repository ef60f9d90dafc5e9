import { describe, expect, test } from 'vitest'
import type { Front } from '../../../src/api/types'
import { placeOf, placeWord } from '../../../src/format/place'
import {
  allCloud,
  axesOf,
  frontCloud,
  marksOf,
  publishedDesign,
  publishedMarks,
} from '../../../src/job/trade-offs/designs'

const design = (iteration: number, energy: number, speed: number) => ({
  iteration,
  particle: 3,
  objectives: { torque: 1, energy, reciprocal_speed: speed, acceleration: 2 },
})

const FRONT = {
  objectives: ['torque', 'acceleration', 'energy', 'reciprocal_speed'].map((name) => ({ name })),
  designs: [design(0, 5, 1), design(1, 4, 2)],
  knees: [{ ...design(1, 4, 2), distance: 0.3 }],
  winners: [
    { ...design(0, 5, 1), preference: 'job' },
    { ...design(0, 5, 1), preference: 'A' },
    { ...design(2, 9, 9), preference: 'B' },
  ],
} as unknown as Front

test('a design in the address is parsed; anything else is null', () => {
  expect(placeOf(placeWord({ iteration: 24, particle: 7 }))).toEqual({ iteration: 24, particle: 7 })
  expect(placeWord({ iteration: 24, particle: 7 })).toBe('24.7')
  expect(placeOf('24/7')).toBeNull()
  expect(placeOf('24')).toBeNull()
  expect(placeOf(null)).toBeNull()
})

describe('axes', () => {
  test('are those requested', () => {
    expect(axesOf(FRONT, 'energy', 'torque')).toEqual(['energy', 'torque'])
  })

  test('default to speed and acceleration, and always differ', () => {
    expect(axesOf(FRONT, null, null)).toEqual(['reciprocal_speed', 'acceleration'])
    expect(axesOf(FRONT, 'acceleration', 'acceleration')).toEqual([
      'acceleration',
      'reciprocal_speed',
    ])
    expect(axesOf(FRONT, 'height', 'energy')).toEqual(['energy', 'reciprocal_speed'])
  })
})

describe('a published design', () => {
  const walk = (energy: number, status = 'ok') => ({
    status,
    objectives: { torque: 1, acceleration: 2, energy, reciprocal_speed: 3 },
  })
  const of = (...walks: readonly unknown[]) =>
    publishedDesign(FRONT, { label: 'published A', scenarios: { ...walks } as never })

  test('is the geometric mean over its simulations, like those of the front', () => {
    const design = of(walk(2), walk(8))!
    expect(design.objectives.energy).toBeCloseTo(4)
    expect(publishedMarks([design], 'energy', 'torque')[0]).toMatchObject({
      name: 'published A',
      y: 1,
    })
  })

  test('is omitted if a simulation failed', () => {
    expect(of(walk(2), walk(8, 'fell'))).toBeNull()
  })
})

describe('the chart', () => {
  test('shows the front by two objectives, in its order', () => {
    const { x, y } = frontCloud(FRONT, 'energy', 'reciprocal_speed')
    expect([x, y]).toEqual([
      [5, 4],
      [1, 2],
    ])
  })

  test('has one mark per winner with all its preferences, on the front or not', () => {
    const marks = marksOf(FRONT, 'energy', 'reciprocal_speed')
    expect(marks.map(({ name, x, y }) => [name, x, y])).toEqual([
      ['job, A', 5, 1],
      ['B', 9, 9],
      ['knee 1', 4, 2],
    ])
  })

  test('shows all designs behind the front if their objectives are loaded', () => {
    const column = (name: string, values: number[]) => ({ name, values: Float32Array.from(values) })
    const particles = {
      columns: [column('objective:energy', [5]), column('objective:torque', [1])],
    }
    expect(allCloud(particles as never, 'energy', 'torque')).toMatchObject({
      x: Float32Array.from([5]),
      y: Float32Array.from([1]),
    })
    expect(allCloud(particles as never, 'energy', 'acceleration')).toBeNull()
  })
})
