/** A choice among a few options, as adjacent buttons. */

export function Segmented<K extends string>({
  label,
  value,
  options,
  onChoose,
  roomy = false,
}: {
  label: string
  /** Several for equivalent options; empty if none applies. */
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
