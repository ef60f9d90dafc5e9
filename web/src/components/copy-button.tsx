/** Text to copy into a shell or a file. */

import { useState } from 'preact/hooks'

export function CopyBlock({ text, label }: { text: string; label: string }) {
  return (
    <div class="command">
      {/* A scrollable box must be reachable by keyboard. */}
      <pre tabIndex={0}>{text}</pre>
      <CopyButton text={text} label={label} />
    </div>
  )
}

/** The address of the view, which has all of its state. */
export function CopyLink() {
  return (
    <CopyButton
      text={() => location.href}
      label="link"
      caption="Copy link"
      failed="Copy it from the address bar"
    />
  )
}

interface CopyButtonProps {
  text: string | (() => string)
  label: string
  caption?: string
  failed?: string
}

export function CopyButton({
  text,
  label,
  caption = 'Copy',
  failed = 'Select the text to copy it',
}: CopyButtonProps) {
  const [status, setStatus] = useState('')
  const copy = async () => {
    setStatus((await copied(typeof text === 'string' ? text : text())) ? 'Copied' : failed)
    setTimeout(() => setStatus(''), 2500)
  }
  return (
    <>
      <button type="button" class="compact" onClick={copy} aria-label={`Copy ${label}`}>
        {status === '' ? caption : status}
      </button>
      <span class="visually-hidden" role="status">
        {status}
      </span>
    </>
  )
}

/** Browsers deny the clipboard to pages served over plain HTTP from another host. */
async function copied(text: string): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text)
    return true
  } catch {
    return false
  }
}
