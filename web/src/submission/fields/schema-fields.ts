/** What the API's OpenAPI document says of fields: bounds, units, defaults, choices. */

import { formatExact } from '../../format/number'

export interface SchemaField {
  readonly name: string
  readonly description: string
  /** From the brackets in the description; `1` if there are none. */
  readonly unit: string
  readonly type: 'number' | 'integer' | 'string' | 'boolean' | 'other'
  readonly low: number | null
  readonly high: number | null
  /** Whether the bound itself is not allowed. */
  readonly above: boolean
  readonly below: boolean
  readonly choices: readonly string[] | null
  readonly default: unknown
  readonly required: boolean
}

interface Property {
  type?: string
  description?: string
  minimum?: number
  maximum?: number
  exclusiveMinimum?: number
  exclusiveMaximum?: number
  enum?: unknown[]
  const?: unknown
  default?: unknown
  anyOf?: Property[]
}

export interface OpenApiDocument {
  readonly components: { readonly schemas: Readonly<Record<string, ObjectSchema>> }
}

export interface ObjectSchema {
  readonly properties?: Readonly<Record<string, Property>>
  readonly required?: readonly string[]
}

/** The fields of a schema by name, in its order. Throws if the document has no such schema. */
export function fieldsOf(
  document: OpenApiDocument,
  schema: string,
): ReadonlyMap<string, SchemaField> {
  const found = document.components.schemas[schema]
  if (!found?.properties) throw new Error(`the API's document has no schema ${schema}`)
  return fieldsIn(found)
}

/** The fields of an object that a schema describes, by name and in its order. */
export function fieldsIn(schema: ObjectSchema): ReadonlyMap<string, SchemaField> {
  const required = new Set(schema.required ?? [])
  return new Map(
    Object.entries(schema.properties ?? {}).map(([name, property]) => [
      name,
      fieldOf(name, property, required.has(name)),
    ]),
  )
}

/** The bounds in words: `0.2 to 10`, `above 0, at most 1`, `at least 0`; empty without bounds. */
export function boundsInWords({ low, high, above, below }: SchemaField): string {
  if (low === null && high === null) return ''
  const least = `${above ? 'above' : 'at least'} ${formatExact(low, 8)}`
  const most = `${below ? 'below' : 'at most'} ${formatExact(high, 8)}`
  // Bounds that only keep numbers within what a computer holds are of no interest.
  if (high === null || high > 1e15) return least
  if (low === null) return most
  return above || below ? `${least}, ${most}` : `${formatExact(low, 8)} to ${formatExact(high, 8)}`
}

/** Description without its unit, and without the marks of code. */
export function describe({ description }: SchemaField): string {
  return description.replace(/\s*\[[^\]]*\]/, '').replaceAll('`', '')
}

function fieldOf(name: string, given: Property, required: boolean): SchemaField {
  const property = { ...given, ...orNull(given) }
  const description = property.description ?? ''
  const { type } = property
  return {
    name,
    description,
    unit: /\[([^\]]+)\]/.exec(description)?.[1] ?? '1',
    type: isPlain(type) ? type : 'other',
    low: property.minimum ?? property.exclusiveMinimum ?? null,
    high: property.maximum ?? property.exclusiveMaximum ?? null,
    above: property.exclusiveMinimum !== undefined,
    below: property.exclusiveMaximum !== undefined,
    choices:
      property.enum?.map(String) ??
      (property.const === undefined ? null : [String(property.const)]),
    default: property.default,
    required,
  }
}

function isPlain(type: string | undefined): type is Exclude<SchemaField['type'], 'other'> {
  return type !== undefined && ['number', 'integer', 'string', 'boolean'].includes(type)
}

/** Of a property that may be null instead: what else it may be. */
function orNull({ anyOf }: Property): Property | undefined {
  const others = anyOf?.filter(({ type }) => type !== 'null')
  return anyOf?.length === 2 && others?.length === 1 ? others[0] : undefined
}
