import { describe, expect, test } from 'vitest'
import type { JobSpec } from '../src/api/types'
import { around } from '../src/submission/around-design'
import { errorsByField, specOf, withKinds } from '../src/submission/build-spec'
import { caseDraft, caseFields } from '../src/submission/case'
import { ofLegGroups } from '../src/submission/catalogue'
import { type Draft, draftOf, emptyDraft, scenarioDraft } from '../src/submission/draft'
import { optimizerDraft, settingsOf, withPreset } from '../src/submission/optimizer'
import { ofKind, withRobotJob } from '../src/submission/robot/job'
import { boundsInWords, fieldsOf } from '../src/submission/schema-fields'
import { counts, walksEach, worldsFields } from '../src/submission/worlds'
import { CATALOGUE, DOCUMENT } from './catalogue-example'

const empty = emptyDraft(CATALOGUE)

const withOwnScenario: Draft = {
  ...empty,
  presets: ['fast'],
  own: [scenarioDraft(CATALOGUE.fields.scenario, CATALOGUE.scenarios[1], 'mine')],
}

describe('a draft', () => {
  test('begins with the defaults that the API documents', () => {
    expect(specOf(empty)).toEqual({
      name: '',
      robot: 'hexapod',
      controller: 'pi',
      scenarios: ['fast', 'loaded'],
      variables: [
        { name: 'P', low: 0, high: 1 },
        { name: 'FOMF', low: 1, high: 3 },
      ],
      fixed: {},
      preference: 'A',
      optimizer: { name: 'pso', particles: 25, inertia_end: 0.7 },
      iterations: 25,
      seed: 1,
      precision: 'double',
    })
  })

  test('starts from the best of jobs that are named, or else from those of a cloned job', () => {
    const started = (changes: Partial<Draft['start']>) =>
      specOf({ ...empty, start: { ...empty.start, ...changes } }).start
    expect(specOf(empty)).not.toHaveProperty('start')
    expect(started({ jobs: ['k2q7', 'm3x8'] })).toEqual({ jobs: ['k2q7', 'm3x8'], count: 5 })
    expect(started({ jobs: ['k2q7'], count: 'many' })).toEqual({ jobs: ['k2q7'], count: 'many' })
    const cloned = draftOf({ start: [{ P: 0.4 }, { P: 0.5 }] } as unknown as JobSpec, CATALOGUE)
    expect(specOf(cloned).start).toEqual([{ P: 0.4 }, { P: 0.5 }])
    expect(started({ jobs: ['k2q7'], designs: [{ P: 0.4 }] })).toHaveProperty('jobs')
    const named = draftOf({ start: { jobs: ['k2q7'], count: 9 } } as unknown as JobSpec, CATALOGUE)
    expect(specOf(named).start).toEqual({ jobs: ['k2q7'], count: 9 })
  })

  test('sends fixed and gait variables as they were set', () => {
    const { P, stride, ...rest } = empty.variables
    const spec = specOf({
      ...empty,
      variables: {
        ...rest,
        P: { ...P, mode: 'fixed', value: '0.5' },
        stride: { ...stride, mode: 'searched', low: '0.12' },
      },
    })
    expect(spec.fixed).toEqual({ P: 0.5 })
    expect(spec.variables).toContainEqual({ name: 'stride', low: 0.12, high: 0.2 })
  })

  test('keeps variables of leg groups, and offers them for those variables alone', () => {
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

  test('sends objects of a scenario of one’s own as they are written', () => {
    const [own] = withOwnScenario.own
    const written = { ...own, by_group: '{"stride[front]": 0.05}', phases: '{"a": ' }
    const [, sent] = specOf({ ...withOwnScenario, own: [written] }).scenarios ?? []
    expect(sent).toMatchObject({ by_group: { 'stride[front]': 0.05 }, phases: '{"a": ' })
    const again = draftOf({ scenarios: [sent] } as unknown as JobSpec, CATALOGUE)
    expect(again.own[0].by_group).toBe('{"stride[front]":0.05}')
  })

  test('sends a categorical variable by the names of its choices', () => {
    const { window, ...rest } = empty.variables
    expect(window).toMatchObject({ mode: 'default', value: 'flat' })
    const searched = specOf({
      ...empty,
      variables: { ...rest, window: { ...window, mode: 'searched', choices: ['flat', 'hann'] } },
    })
    expect(searched.variables).toContainEqual({
      name: 'window',
      kind: 'categorical',
      choices: ['flat', 'hann'],
    })
    const fixed = {
      ...empty,
      variables: { ...rest, window: { ...window, mode: 'fixed' as const } },
    }
    expect(specOf(fixed).fixed).toEqual({ window: 'flat' })
  })

  test('leaves conventions at their default unless they are set', () => {
    const { integral_span: span, ...rest } = empty.variables
    expect(specOf(empty).fixed).toEqual({})
    const fixed = {
      ...empty,
      variables: { ...rest, integral_span: { ...span, mode: 'fixed' as const } },
    }
    expect(specOf(fixed).fixed).toEqual({ integral_span: 2 })
    expect(draftOf(specOf(fixed), CATALOGUE).variables.integral_span.mode).toBe('fixed')
  })

  test('leaves what is no number for the API to refuse', () => {
    expect(specOf({ ...empty, iterations: 'many' }).iterations).toBe('many')
    expect(specOf({ ...empty, seed: '' }).seed).toBe('')
  })

  test('keeps the kind of integer variables', () => {
    const spec = withKinds(specOf(empty), CATALOGUE.controllers[0].variables)
    expect(spec.variables).toContainEqual({ name: 'FOMF', low: 1, high: 3, kind: 'integer' })
  })

  test('sends a variant of the robot with numbers', () => {
    const robot = { ...empty.robot, kind: 'variant' as const, backlash: ['2.5', '1', '1'] }
    expect(specOf({ ...empty, robot }).robot).toEqual({
      name: 'hexapod',
      contact_law: null,
      planned_soles: null,
      backlash: [2.5, 1, 1],
    })
  })

  test('names the robot that was chosen, and what a variant of it changes', () => {
    const robot = { ...empty.robot, name: 'hexapod-identified' }
    expect(specOf({ ...empty, robot }).robot).toBe('hexapod-identified')
    const stick = { ...robot, kind: 'variant' as const, contact_law: 'stick' }
    expect(specOf({ ...empty, robot: stick }).robot).toMatchObject({
      name: 'hexapod-identified',
      contact_law: 'stick',
    })
  })

  test('offers the choices of a field that may be null', () => {
    expect(CATALOGUE.fields.variant.get('contact_law')?.choices).toEqual(['linear_zone', 'stick'])
  })
})

describe('worlds', () => {
  const { fields } = CATALOGUE
  const robust = (values: Record<string, string> = {}): Draft => ({
    ...empty,
    worlds: { ...empty.worlds, robust: true, values: { ...empty.worlds.values, ...values } },
  })

  test('are left out unless the job is to be robust', () => {
    expect(specOf(empty)).not.toHaveProperty('worlds')
    expect(walksEach(empty.worlds)).toBe(1)
    expect(specOf(robust()).worlds).toEqual({ count: 8, seed: 1, aggregate: 'cvar', level: 0.75 })
  })

  test('are what the schema lets be set, in its order', () => {
    const names = worldsFields(fields.worlds).map(({ name }) => name)
    expect(names).toEqual(['count', 'seed', 'aggregate', 'level'])
  })

  test('multiply the walks of a design', () => {
    expect(walksEach(robust({ count: '12' }).worlds)).toBe(12)
    expect(walksEach(robust({ count: 'many' }).worlds)).toBeNaN()
    expect(specOf(robust({ count: 'many' })).worlds).toMatchObject({ count: 'many' })
    expect(specOf(robust({ count: '' })).worlds).toMatchObject({ count: '' })
  })

  test('have a level for a quantile and a value at risk only', () => {
    const level = fields.worlds.get('level')!
    const asked = (aggregate: string) => counts(level, robust({ aggregate }).worlds)
    expect(['mean', 'quantile', 'worst', 'cvar'].filter(asked)).toEqual(['quantile', 'cvar'])
  })

  test('of a cloned job are asked for again, with their ranges', () => {
    const worlds = {
      count: 3,
      seed: 5,
      aggregate: 'worst',
      level: 0.5,
      ranges: ['friction_factor'],
    }
    const cloned = draftOf({ worlds } as unknown as JobSpec, CATALOGUE)
    expect(specOf(cloned).worlds).toEqual(worlds)
    const all = { ...cloned, worlds: { ...cloned.worlds, ranges: null } }
    expect(specOf(all).worlds).not.toHaveProperty('ranges')
  })
})

describe('the optimizer', () => {
  const { optimizers } = CATALOGUE
  const [pso, thesis, simplex] = optimizers

  test('is the default method at first, with its settings', () => {
    expect(empty.optimizer).toEqual({ name: 'pso', particles: '25', inertia_end: '0.7' })
    expect(specOf(empty).optimizer).toEqual(pso.settings)
  })

  test('keeps the size of its iterations with a preset or another method', () => {
    const large = { name: 'pso', particles: '40', inertia_end: '0.7' }
    expect(withPreset(large, thesis)).toEqual({ name: 'pso', particles: '40', inertia_end: '0.9' })
    expect(withPreset(large, simplex)).toMatchObject({ name: 'simplex', particles: '40' })
    expect(withPreset(large, simplex)).not.toHaveProperty('inertia_end')
  })

  test('offers what the schema of the method has, but its name', () => {
    const fields = new Map(settingsOf(simplex).map((field) => [field.name, field]))
    expect([...fields.keys()]).toEqual(['particles', 'restarts', 'steps', 'order'])
    expect(fields.get('restarts')).toMatchObject({
      type: 'boolean',
      description: 'Whether it starts anew.',
    })
    expect(fields.get('order')?.choices).toEqual(['1', '2'])
    expect(boundsInWords(fields.get('particles')!)).toBe('1 to 10\u202f000')
  })

  test('becomes numbers, truth values and lists again, and nothing where it is left empty', () => {
    const { optimizer } = draftOf({ ...specOf(empty), optimizer: 'simplex' } as never, CATALOGUE)
    expect(specOf({ ...empty, optimizer }).optimizer).toEqual({
      name: 'simplex',
      particles: 25,
      restarts: true,
      steps: [1, 2],
    })
    const wrong = { ...optimizer, restarts: 'false', steps: '[1, ', order: 'two' }
    expect(specOf({ ...empty, optimizer: wrong }).optimizer).toMatchObject({
      restarts: false,
      steps: '[1, ',
      order: 'two',
    })
  })

  test('of a job to be cloned may be a name, or settings without their defaults', () => {
    const named = draftOf({ ...specOf(empty), optimizer: 'pso-thesis' }, CATALOGUE)
    expect(named.optimizer.inertia_end).toBe('0.9')
    expect(optimizerDraft(optimizers, { name: 'simplex', particles: 3 }, 'pso')).toMatchObject({
      particles: '3',
      restarts: 'true',
    })
    expect(optimizerDraft(optimizers, { particles: 3 }, 'pso')).toMatchObject({
      name: 'pso',
      inertia_end: '0.7',
    })
  })
})

describe('a clone', () => {
  const resolved = {
    ...specOf(empty),
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
    optimizer: { name: 'pso', particles: 7, inertia_end: 0.7 },
    iterations: 3,
    seed: 9,
    precision: 'single',
  } as unknown as JobSpec
  const draft = draftOf(resolved, CATALOGUE)

  test('knows presets by their values and keeps the others as they are', () => {
    expect(draft.presets).toEqual(['fast'])
    expect(draft.own).toEqual([{ name: 'mine', radius: '0.2', load: '1' }])
    expect(draft.preference.kind).toBe('C')
  })

  test('asks for the same job again', () => {
    const again = specOf(draft)
    expect(again).toEqual({
      ...resolved,
      scenarios: ['fast', resolved.scenarios![1]],
      preference: 'C',
    })
  })

  test('keeps the robot that was named', () => {
    for (const robot of [
      'hexapod-identified',
      { name: 'hexapod-identified', contact_law: null, planned_soles: 'own', backlash: [1, 0, 0] },
    ]) {
      const again = specOf(draftOf({ ...resolved, robot } as unknown as JobSpec, CATALOGUE))
      expect(again.robot).toEqual(robot)
    }
  })

  test('has the choices that were searched, and the name of one that was fixed by its index', () => {
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

  test('of a preference of one’s own stays so', () => {
    const own = { bias: [1, 1, 1, 1, 1], exponent: [1, 1, 1, 1, 0] } as JobSpec['preference']
    expect(specOf(draftOf({ ...resolved, preference: own }, CATALOGUE)).preference).toEqual(own)
  })
})

describe('the neighbourhood of a design', () => {
  const near = (design: Record<string, number>) =>
    around(empty, design, new Set(['FOMF'])).variables

  test('is a part of the range around it', () => {
    expect(near({ P: 0.5 }).P).toMatchObject({ low: '0.35', high: '0.65' })
  })

  test('stays within the bounds and keeps its width', () => {
    expect(near({ P: 1 }).P).toMatchObject({ low: '0.7', high: '1' })
  })

  test('leaves a categorical variable its choices', () => {
    const window = { ...empty.variables.window, mode: 'searched' as const }
    const draft = { ...empty, variables: { ...empty.variables, window } }
    expect(around(draft, { window: 'hamming' }, new Set()).variables.window).toEqual(window)
  })

  test('of an integer variable has whole bounds that differ', () => {
    expect(near({ FOMF: 2 }).FOMF).toMatchObject({ low: '1', high: '3' })
  })
})

describe('a problem', () => {
  const found = (field: string) => [
    ...errorsByField([{ field, message: 'is wrong' }], withOwnScenario).keys(),
  ]

  test.each([
    ['iterations', 'iterations'],
    ['optimizer.particles', 'optimizer.particles'],
    ['variables.1.low', 'variables.FOMF.low'],
    ['fixed.P', 'variables.P.value'],
    ['scenarios.1.radius', 'own.0.radius'],
    ['scenarios.0', 'scenarios'],
    ['', ''],
  ])('of %s is shown at %s', (field, shown) => {
    expect(found(field)).toEqual([shown])
  })

  test('does not hide another one of the same field', () => {
    const errors = errorsByField(
      [
        { field: 'seed', message: 'one' },
        { field: 'seed', message: 'two' },
      ],
      empty,
    )
    expect(errors.get('seed')).toBe('one; two')
  })
})

describe('fields of the schema', () => {
  const scenario = fieldsOf(DOCUMENT, 'Scenario')

  test('carry their unit, bounds and default', () => {
    expect(scenario.get('radius')).toMatchObject({ unit: 'm', low: 0, high: 1, required: true })
    expect(scenario.get('load')).toMatchObject({ unit: '1', default: 0, required: false })
  })

  test('say their bounds in words', () => {
    expect(boundsInWords(scenario.get('radius')!)).toBe('above 0, at most 1')
    expect(boundsInWords(scenario.get('load')!)).toBe('0 to 50')
    expect(boundsInWords(fieldsOf(DOCUMENT, 'JobSpec').get('seed')!)).toBe('at least 0')
  })

  test('of a schema that is not there are an error', () => {
    expect(() => fieldsOf(DOCUMENT, 'Nothing')).toThrow('no schema Nothing')
  })
})

describe("a robot's own folder", () => {
  const files: Draft = { ...empty, name: 'mine', ...ofKind(empty, 'files', empty) }
  const slow = { name: 'slow', cycle_time: 2 }

  test('brings its scenarios and variables in place of those of the robot that ships', () => {
    expect(specOf(files).scenarios).toEqual([])
    const job = JSON.stringify({
      controller: 'pi',
      scenarios: [slow],
      variables: [{ name: 'P', low: 1, high: 2 }],
      fixed: { FOMF: 2 },
    })
    const spec = specOf(withRobotJob(files, CATALOGUE, job))
    expect(spec).toMatchObject({ name: 'mine', robot: { toml: '', urdf: '' }, scenarios: [slow] })
    expect(spec.variables).toEqual([{ name: 'P', low: 1, high: 2 }])
    expect(spec.fixed).toEqual({ FOMF: 2 })
    expect(spec.iterations).toBe(25)
  })

  test('is left behind for a robot that ships', () => {
    const back = { ...files, ...ofKind(files, 'shipped', empty) }
    expect(specOf(back)).toEqual(specOf({ ...empty, name: 'mine' }))
  })

  test.each([
    ['{', /no JSON/],
    ['[]', /one JSON object/],
    ['{"controller": "none"}', /controller none/],
  ])('is refused where it is %s', (text, message) => {
    expect(() => withRobotJob(files, CATALOGUE, text)).toThrow(message)
  })
})

test("a plug-in's case is chosen with its settings, and known again in a spec", () => {
  const [damped] = CATALOGUE.cases
  expect(caseFields(damped).map(({ name }) => name)).toEqual(['share'])
  const spec = specOf({ ...empty, case: { ...caseDraft(damped), share: '0.3' } })
  expect(spec.case).toEqual({ name: 'damped', share: 0.3 })
  expect(specOf(draftOf(spec, CATALOGUE)).case).toEqual({ name: 'damped', share: 0.3 })
  const named = draftOf({ case: 'damped' } as unknown as JobSpec, CATALOGUE)
  expect(specOf(named).case).toEqual({ name: 'damped', share: 0.1 })
  expect(specOf(empty)).not.toHaveProperty('case')
})
