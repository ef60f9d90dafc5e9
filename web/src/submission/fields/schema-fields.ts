/** Fields of OpenAPI schemas: bounds, units, defaults and choices. */

import { formatExact } from '../../format/number'

export type SchemaField = ReturnType<typeof fieldOf>

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

/** Fields of a schema by name, in order. Throws if the schema is missing. */
export function fieldsOf(
  document: OpenApiDocument,
  schema: string,
): ReadonlyMap<string, SchemaField> {
  const objectSchema = document.components.schemas[schema]
  if (!objectSchema?.properties) throw new Error(`the API's document has no schema ${schema}`)
  return fieldsIn(objectSchema)
}

export function fieldsIn(schema: ObjectSchema): ReadonlyMap<string, SchemaField> {
  const required = new Set(schema.required ?? [])
  return new Map(
    Object.entries(schema.properties ?? {}).map(([name, property]) => [
      name,
      fieldOf(name, property, required.has(name)),
    ]),
  )
}

/** Bounds as text: `0.2 to 10`, `above 0, at most 1`, `at least 0`; empty without bounds. */
export function boundsInWords({ low, high, above, below }: SchemaField): string {
  if (low === null && high === null) return ''
  const least = `${above ? 'above' : 'at least'} ${formatExact(low, 8)}`
  const most = `${below ? 'below' : 'at most'} ${formatExact(high, 8)}`
  // Bounds that only prevent overflow are not shown.
  if (high === null || high > 1e15) return least
  if (low === null) return most
  return above || below ? `${least}, ${most}` : `${formatExact(low, 8)} to ${formatExact(high, 8)}`
}

/** Description without its unit and without backticks. */
export function describe({ description }: SchemaField): string {
  return description.replace(/\s*\[[^\]]*\]/, '').replaceAll('`', '')
}

const PLAIN = ['number', 'integer', 'string', 'boolean'] as const

/** `unit` is `1` if the description has none in brackets; `above` and `below` mark exclusive bounds. */
function fieldOf(name: string, declared: Property, required: boolean) {
  const property = { ...declared, ...orNull(declared) }
  const description = property.description ?? ''
  const { type } = property
  return {
    name,
    description,
    unit: /\[([^\]]+)\]/.exec(description)?.[1] ?? '1',
    type: PLAIN.find((plain) => plain === type) ?? 'other',
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

function orNull({ anyOf }: Property): Property | undefined {
  const others = anyOf?.filter(({ type }) => type !== 'null')
  return anyOf?.length === 2 && others?.length === 1 ? others[0] : undefined
}
