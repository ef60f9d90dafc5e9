import { describe, expect, test } from 'vitest'
import type { JobSpec } from '../../../src/api/types'
import { errorsByField, specOf, withKinds } from '../../../src/submission/draft/build-spec'
import { ofLegGroups } from '../../../src/submission/draft/catalogue'
import { type Draft, draftOf } from '../../../src/submission/draft/draft'
import { CATALOGUE } from '../catalogue-example'
import { EMPTY, withCustomScenario } from './drafts'

describe('a draft', () => {
  test('starts with the defaults documented by the API, and a search that keeps the published design', () => {
    expect(specOf(EMPTY)).toEqual({
      name: '',
      robot: 'hexapod',
      controller: 'pi',
      scenarios: ['fast', 'loaded'],
      variables: [
        { name: 'P', low: 0, high: 1 },
        { name: 'FOMF', low: 1, high: 3 },
        { name: 'stride', low: 0.06, high: 0.2 },
      ],
      fixed: {},
      preference: 'A',
      constraints: ['*<=published:A'],
      optimizer: { name: 'pso', particles: 25, inertia_end: 0.9 },
      iterations: 25,
      seed: 1,
      precision: 'double',
    })
  })

  test('starts from the best of the named jobs, otherwise from the designs of a cloned job', () => {
    const started = (changes: Partial<Draft['start']>) =>
      specOf({ ...EMPTY, start: { ...EMPTY.start, ...changes } }).start
    expect(specOf(EMPTY)).not.toHaveProperty('start')
    expect(started({ jobs: ['k2q7', 'm3x8'] })).toEqual({ jobs: ['k2q7', 'm3x8'], count: 5 })
    expect(started({ jobs: ['k2q7'], count: 'many' })).toEqual({ jobs: ['k2q7'], count: 'many' })
    const cloned = draftOf({ start: [{ P: 0.4 }, { P: 0.5 }] } as unknown as JobSpec, CATALOGUE)
    expect(specOf(cloned).start).toEqual([{ P: 0.4 }, { P: 0.5 }])
    expect(started({ jobs: ['k2q7'], designs: [{ P: 0.4 }] })).toHaveProperty('jobs')
    const named = draftOf({ start: { jobs: ['k2q7'], count: 9 } } as unknown as JobSpec, CATALOGUE)
    expect(specOf(named).start).toEqual({ jobs: ['k2q7'], count: 9 })
  })

  test('sends fixed and gait variables as set', () => {
    const { P, stride, ...rest } = EMPTY.variables
    const spec = specOf({
      ...EMPTY,
      variables: {
        ...rest,
        P: { ...P, mode: 'fixed', value: '0.5' },
        stride: { ...stride, mode: 'searched', low: '0.12' },
      },
    })
    expect(spec.fixed).toEqual({ P: 0.5 })
    expect(spec.variables).toContainEqual({ name: 'stride', low: 0.12, high: 0.2 })
  })

  test('keeps variables of leg groups, and offers them for eligible variables only', () => {
    const stride = { name: 'stride[front]', low: 0.1, high: 0.15 }
    const cloned = draftOf(
      {
        variables: [stride],
        fixed: { P: 0.4, FOMF: 2, 'stride[hind]': 0.12 },
      } as unknown as JobSpec,
      CATALOGUE,
    )
    const spec = specOf(cloned)
    expect(spec.variables).toContainEqual(stride)
    expect(spec.fixed).toMatchObject({ 'stride[hind]': 0.12 })
    const gait = CATALOGUE.controllers[0].gait_variables
    const names = ['stride[left_rear]', 'stride', 'window[front]', 'stride[]', 'P[front]']
    expect(ofLegGroups(gait, names).map(({ name }) => name)).toEqual(['stride[left_rear]'])
  })

  test('sends objects of a custom scenario as written', () => {
    const [custom] = withCustomScenario.custom
    const written = { ...custom, by_group: '{"stride[front]": 0.05}', phases: '{"a": ' }
    const [, sent] = specOf({ ...withCustomScenario, custom: [written] }).scenarios ?? []
    expect(sent).toMatchObject({ by_group: { 'stride[front]': 0.05 }, phases: '{"a": ' })
    const reread = draftOf({ scenarios: [sent] } as unknown as JobSpec, CATALOGUE)
    expect(reread.custom[0].by_group).toBe('{"stride[front]":0.05}')
  })

  test('sends a categorical variable by the names of its choices', () => {
    const { window, ...rest } = EMPTY.variables
    expect(window).toMatchObject({ mode: 'default', value: 'flat' })
    const searched = specOf({
      ...EMPTY,
      variables: { ...rest, window: { ...window, mode: 'searched', choices: ['flat', 'hann'] } },
    })
    expect(searched.variables).toContainEqual({
      name: 'window',
      kind: 'categorical',
      choices: ['flat', 'hann'],
    })
    const fixed = {
      ...EMPTY,
      variables: { ...rest, window: { ...window, mode: 'fixed' as const } },
    }
    expect(specOf(fixed).fixed).toEqual({ window: 'flat' })
  })

  test('keeps conventions at their default unless set', () => {
    const { integral_span: span, ...rest } = EMPTY.variables
    expect(specOf(EMPTY).fixed).toEqual({})
    const fixed = {
      ...EMPTY,
      variables: { ...rest, integral_span: { ...span, mode: 'fixed' as const } },
    }
    expect(specOf(fixed).fixed).toEqual({ integral_span: 2 })
    expect(draftOf(specOf(fixed), CATALOGUE).variables.integral_span.mode).toBe('fixed')
  })

  test('passes invalid numbers on for the API to reject', () => {
    expect(specOf({ ...EMPTY, iterations: 'many' }).iterations).toBe('many')
    expect(specOf({ ...EMPTY, seed: '' }).seed).toBe('')
  })

  test('keeps the kind of integer variables', () => {
    const spec = withKinds(specOf(EMPTY), CATALOGUE.controllers[0].variables)
    expect(spec.variables).toContainEqual({ name: 'FOMF', low: 1, high: 3, kind: 'integer' })
  })

  test('sends a robot variant with numbers', () => {
    const robot = { ...EMPTY.robot, kind: 'variant' as const, backlash: ['2.5', '1', '1'] }
    expect(specOf({ ...EMPTY, robot }).robot).toEqual({
      name: 'hexapod',
      contact_law: null,
      planned_soles: null,
      backlash: [2.5, 1, 1],
    })
  })

  test('sends the chosen robot, and the changes of a variant', () => {
    const robot = { ...EMPTY.robot, name: 'hexapod-identified' }
    expect(specOf({ ...EMPTY, robot }).robot).toBe('hexapod-identified')
    const stick = { ...robot, kind: 'variant' as const, contact_law: 'stick' }
    expect(specOf({ ...EMPTY, robot: stick }).robot).toMatchObject({
      name: 'hexapod-identified',
      contact_law: 'stick',
    })
  })

  test('offers the choices of a nullable field', () => {
    expect(CATALOGUE.fields.variant.get('contact_law')?.choices).toEqual(['linear_zone', 'stick'])
  })
})

describe('a clone', () => {
  const resolved = {
    ...specOf(EMPTY),
    name: 'first',
    scenarios: [
      { name: 'fast', radius: 0.16, load: 0 },
      { name: 'mine', radius: 0.2, load: 1 },
    ],
    variables: [{ name: 'P', low: 0.1, high: 0.9 }],
    fixed: { FOMF: 2 },
    preference: {
      bias: [0, 0, 0, 0, 0],
      exponent: [1, 1, 1, 1, 1],
    },
    optimizer: { name: 'pso', particles: 7, inertia_end: 0.9 },
    iterations: 3,
    seed: 9,
    precision: 'single',
  } as unknown as JobSpec
  const draft = draftOf(resolved, CATALOGUE)

  test('recognizes presets by their values and keeps the others', () => {
    expect(draft.presets).toEqual(['fast'])
    expect(draft.custom).toEqual([{ name: 'mine', radius: '0.2', load: '1' }])
    expect(draft.preference.kind).toBe('C')
  })

  test('yields the same job', () => {
    const reread = specOf(draft)
    expect(reread).toEqual({
      ...resolved,
      scenarios: ['fast', resolved.scenarios![1]],
      preference: 'C',
    })
  })

  test('keeps the robot', () => {
    for (const robot of [
      'hexapod-identified',
      { name: 'hexapod-identified', contact_law: null, planned_soles: 'own', backlash: [1, 0, 0] },
    ]) {
      const reread = specOf(draftOf({ ...resolved, robot } as unknown as JobSpec, CATALOGUE))
      expect(reread.robot).toEqual(robot)
    }
  })

  test('has the searched choices, and a fixed choice by name', () => {
    const window = {
      name: 'window',
      kind: 'categorical',
      low: 0,
      high: 1,
      choices: ['flat', 'hann'],
    }
    const searched = draftOf({ ...resolved, variables: [window] } as unknown as JobSpec, CATALOGUE)
    expect(searched.variables.window).toMatchObject({ mode: 'searched', choices: ['flat', 'hann'] })
    const fixed = draftOf({ ...resolved, fixed: { window: 1 } } as unknown as JobSpec, CATALOGUE)
    expect(fixed.variables.window).toMatchObject({ mode: 'fixed', value: 'hamming' })
  })

  test('keeps a custom preference', () => {
    const custom = { bias: [1, 1, 1, 1, 1], exponent: [1, 1, 1, 1, 0] } as JobSpec['preference']
    expect(specOf(draftOf({ ...resolved, preference: custom }, CATALOGUE)).preference).toEqual(
      custom,
    )
  })
})

describe('an API error', () => {
  const fieldsOf = (field: string) => [
    ...errorsByField([{ field, message: 'is wrong' }], withCustomScenario).keys(),
  ]

  test.each([
    ['iterations', 'iterations'],
    ['optimizer.particles', 'optimizer.particles'],
    ['variables.1.low', 'variables.FOMF.low'],
    ['fixed.P', 'variables.P.value'],
    ['scenarios.1.radius', 'custom.0.radius'],
    ['scenarios.0', 'scenarios'],
    ['', ''],
  ])('of %s is shown at %s', (field, shown) => {
    expect(fieldsOf(field)).toEqual([shown])
  })

  test('does not hide another one of the same field', () => {
    const errors = errorsByField(
      [
        { field: 'seed', message: 'one' },
        { field: 'seed', message: 'two' },
      ],
      EMPTY,
    )
    expect(errors.get('seed')).toBe('one; two')
  })
})
