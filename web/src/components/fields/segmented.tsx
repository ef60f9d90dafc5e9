/** A choice of few, as buttons beside each other. */

export function Segmented<K extends string>({
  label,
  value,
  options,
  onChoose,
  roomy = false,
}: {
  label: string
  /** Several where they come to the same; an empty list where none fits. */
  value: K | readonly K[]
  options: readonly (readonly [key: K, text: string])[]
  onChoose: (key: K) => void
  /** As high as the fields of a form. */
  roomy?: boolean
}) {
  const chosen: readonly string[] = typeof value === 'string' ? [value] : value
  return (
    <fieldset class="segmented" aria-label={label}>
      {options.map(([key, text]) => (
        <button
          key={key}
          type="button"
          class={roomy ? undefined : 'compact'}
          aria-pressed={chosen.includes(key)}
          onClick={() => onChoose(key)}
        >
          {text}
        </button>
      ))}
    </fieldset>
  )
}
