/** Objectives as they are shown: the speed in place of its reciprocal. */

export interface WithObjectives {
  readonly objectives: Readonly<Record<string, number | null>>
  readonly measurements?: Readonly<Record<string, number | null>>
}

export interface Quantity {
  readonly name: string
  readonly unit: string
  /** Whether more is better. */
  readonly more: boolean
}

export function quantityOf({ name, unit }: Omit<Quantity, 'more'>): Quantity {
  return name === 'reciprocal_speed'
    ? { name: 'speed', unit: 'm/s', more: true }
    : { name, unit, more: false }
}

/** Value of a quantity; null if it is unknown. */
export function amountOf(
  result: WithObjectives | null | undefined,
  { name }: Pick<Quantity, 'name'>,
): number | null {
  const { objectives = {}, measurements = {} }: Partial<WithObjectives> = result ?? {}
  if (name !== 'speed') return objectives[name] ?? measurements[name] ?? null
  const slowness = objectives.reciprocal_speed
  return slowness ? 1 / slowness : null
}

/** Shape in addition to colour. */
export const MARKS = { better: '✓', same: '=', worse: '✗' } as const
