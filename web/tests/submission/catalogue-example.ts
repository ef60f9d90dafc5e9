/** A small example of the API's catalogue. */

import type { Catalogue } from '../../src/submission/draft/catalogue'
import { fieldsOf, type OpenApiDocument } from '../../src/submission/fields/schema-fields'

export const DOCUMENT: OpenApiDocument = {
  components: {
    schemas: {
      JobSpec: {
        properties: {
          controller: { type: 'string', enum: ['pi', 'p'], default: 'pi' },
          scenarios: { default: ['fast', 'loaded'] },
          preference: { default: 'A' },
          optimizer: { default: { name: 'pso', particles: 25, inertia_end: 0.9 } },
          iterations: { type: 'integer', minimum: 1, maximum: 1_000_000, default: 25 },
          seed: { type: 'integer', minimum: 0, exclusiveMaximum: 2 ** 63, default: 1 },
          precision: { type: 'string', enum: ['single', 'double'], default: 'double' },
          scenario_aggregate: { type: 'string', enum: ['mean', 'worst'], default: 'mean' },
        },
      },
      Scenario: {
        properties: {
          name: { type: 'string', description: 'Name of the scenario.' },
          radius: {
            type: 'number',
            exclusiveMinimum: 0,
            maximum: 1,
            description: 'Lateral distance of the feet [m].',
          },
          load: { type: 'number', minimum: 0, maximum: 50, default: 0 },
          stride: { type: 'number', default: 0.06 },
        },
        required: ['name', 'radius'],
      },
      RobotVariant: {
        properties: {
          name: { type: 'string', enum: ['hexapod', 'hexapod-identified'], default: 'hexapod' },
          contact_law: {
            anyOf: [{ type: 'string', enum: ['linear_zone', 'stick'] }, { type: 'null' }],
          },
          planned_soles: {
            anyOf: [{ type: 'string', enum: ['nominal', 'own'] }, { type: 'null' }],
          },
          backlash: { default: [0, 0, 0] },
        },
      },
      Target: { properties: { quantity: { type: 'string', enum: ['speed', 'mean_current'] } } },
      TuningWorlds: {
        properties: {
          count: { type: 'integer', minimum: 1, maximum: 100, default: 8 },
          seed: { type: 'integer', minimum: 0, default: 1 },
          ranges: { anyOf: [{ type: 'array' }, { type: 'null' }] },
          aggregate: {
            type: 'string',
            enum: ['mean', 'quantile', 'worst', 'cvar'],
            default: 'cvar',
          },
          level: { type: 'number', minimum: 0, exclusiveMaximum: 1, default: 0.75 },
        },
      },
    },
  },
}

const variable = (name: string, low: number, high: number, kind = 'continuous') => ({
  name,
  low,
  high,
  kind,
  unit: '1',
  description: '',
})

const PARTICLES = { type: 'integer', minimum: 1, maximum: 10_000, default: 25 }

const PSO = {
  properties: {
    name: { const: 'pso', default: 'pso', type: 'string' },
    particles: PARTICLES,
    inertia_end: { type: 'number', minimum: 0, maximum: 2, default: 0.9 },
  },
}

export const CATALOGUE = {
  controllers: [
    {
      name: 'pi',
      description: '',
      variables: [variable('P', 0, 1), variable('FOMF', 1, 3, 'integer')],
      conventions: [{ ...variable('integral_span', 0.5, 4), default: 2 }],
      gait_variables: [
        { ...variable('stride', 0.1, 0.2), by_leg_group: true },
        { ...variable('window', 0, 2, 'categorical'), choices: ['flat', 'hamming', 'hann'] },
      ],
      published: { A: { P: 0.45, FOMF: 2 } },
    },
  ],
  cases: [
    {
      name: 'damped',
      description: 'a walk in mud',
      needs: null,
      settings_schema: {
        type: 'object',
        properties: {
          name: { const: 'damped', default: 'damped', type: 'string' },
          share: { type: 'number', default: 0.1, minimum: 0 },
        },
      },
    },
  ],
  robots: [
    { name: 'hexapod', description: 'a hexapod' },
    { name: 'hexapod-identified', description: 'the same, identified' },
  ],
  scenarios: [
    { name: 'fast', radius: 0.16, load: 0, number: 1, simulated_seconds: 4.5 },
    { name: 'loaded', radius: 0.145, load: 2, number: 2, simulated_seconds: 4.5 },
    { name: 'straight', radius: 0.16, load: 0, number: 3, simulated_seconds: 4.5 },
  ],
  preferences: [
    { name: 'A', bias: [0.9, 0.8, 0.24, 0.5, 0.8], exponent: [0.1, 0.7, 0.3, 0.3, 0.1] },
    { name: 'C', bias: [0, 0, 0, 0, 0], exponent: [1, 1, 1, 1, 1] },
  ],
  optimizers: [
    {
      name: 'pso',
      description: 'a swarm',
      settings: { name: 'pso', particles: 25, inertia_end: 0.9 },
      settings_schema: PSO,
    },
    {
      name: 'pso-falling-inertia',
      description: 'a swarm',
      settings: { name: 'pso', particles: 25, inertia_end: 0.7 },
      settings_schema: PSO,
    },
    {
      name: 'simplex',
      description: 'a simplex',
      settings: { name: 'simplex', particles: 25, restarts: true, steps: [1, 2], order: null },
      settings_schema: {
        properties: {
          name: { const: 'simplex', default: 'simplex', type: 'string' },
          particles: PARTICLES,
          restarts: { type: 'boolean', default: true, description: 'Whether it restarts.' },
          steps: { type: 'array', default: [1, 2] },
          order: { anyOf: [{ type: 'integer', enum: [1, 2] }, { type: 'null' }], default: null },
        },
      },
    },
  ],
  fields: {
    job: fieldsOf(DOCUMENT, 'JobSpec'),
    scenario: fieldsOf(DOCUMENT, 'Scenario'),
    variant: fieldsOf(DOCUMENT, 'RobotVariant'),
    worlds: fieldsOf(DOCUMENT, 'TuningWorlds'),
    target: fieldsOf(DOCUMENT, 'Target'),
  },
} as unknown as Catalogue
